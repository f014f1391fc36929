"""The compiled loops of `mavlink_scan`: where the frames of a .tlog begin, and what is in those that are wanted.

They stand in one file because the compiler's cache looks at no other.
"""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Final

import numpy as np

from sparsor.core.compiled import njit
from sparsor.core.mavlink_frames import (
    CHECKSUM,
    HEADER_V1,
    HEADER_V2,
    LONGEST,
    MAGIC_V1,
    MAGIC_V2,
    SIGNATURE,
    SIGNED,
    checksum,
    checksum_extras,
)

if TYPE_CHECKING:
    from numpy.typing import NDArray

STAMP: Final = 8
IDS: Final = 1 << 16  # every message of the dialect has a smaller number
_AHEAD: Final = 2 * (STAMP + LONGEST)  # what lies this far from the end may need bytes that are still to come
_BAD: Final = 0
FRAMES, SKIPPED, DAMAGED, STRANGE, LOST = range(5)
_DAY_US = 86_400_000_000
_AT_ONCE: Final = 8

RECORD = np.dtype(
    [
        ("order", np.int64),
        ("stamp_us", np.uint64),
        ("at", np.int32),
        ("length", np.uint8),
        ("message", np.uint16),
        ("system", np.uint8),
        ("component", np.uint8),
    ],
    align=True,
)
"""One wanted frame: its number among all frames, the stamp before it, place and length of the payload, its sender."""


@cache
def checksum_tables() -> NDArray[np.uint16]:
    """Return the checksum of every byte with 0 to 7 zeros behind it: its share in that of a longer row of bytes."""
    rows = [[checksum(bytes((byte, *bytes(zeros))), 0) for byte in range(256)] for zeros in range(_AT_ONCE)]
    return np.array(rows, dtype=np.uint16)


@cache
def extras_table() -> NDArray[np.int16]:
    """Return CRC_EXTRA by message id, -1 where there is no such message."""
    table = np.full(IDS, -1, dtype=np.int16)
    for number, extra in checksum_extras().items():
        table[number] = extra
    return table


@njit(cache=True, nogil=True)
def scan(
    data: NDArray[np.uint8],
    ended: bool,
    searching: bool,
    tables: NDArray[np.uint16],
    extras: NDArray[np.int16],
    slots: NDArray[np.int16],
    totals: NDArray[np.int64],
    heard: NDArray[np.int64],
    sequence: NDArray[np.int16],
    stamp_us: NDArray[np.uint64],
    records: np.ndarray,
) -> tuple[int, int, bool]:
    """Fill `records`; return where to go on, how many there are, and whether no record begins there."""
    size = data.size
    stop = size if ended else size - _AHEAD
    end = 0  # of the last record
    count = 0
    while end < stop:
        at = end + STAMP
        if not searching:
            length = _frame_length(data, at, tables, extras)
            # What has a checksum that nobody knows is believed where nothing with a right one lies.
            if length < _BAD and _next_frame(data, end, at - length, tables, extras) < 0:
                totals[STRANGE] += 1
                end = at - length
                continue
            if length <= _BAD:
                totals[DAMAGED] += 1
                searching = True
        if searching:
            at = _next_frame(data, end, stop, tables, extras)
            if at < 0:
                left = size if ended else max(end, stop - STAMP)
                totals[SKIPPED] += left - end
                end = left
                break
            length = _frame_length(data, at, tables, extras)
            totals[SKIPPED] += max(at - STAMP - end, 0)
        stamp = _stamp_us(data, at, end)
        if searching and stamp_us[0] > 0 and abs(np.int64(stamp) - np.int64(stamp_us[0])) > _DAY_US:
            stamp = np.uint64(0)  # behind damage, part of it
        searching = False
        if stamp == 0:
            stamp = stamp_us[0]
        stamp_us[0] = stamp
        first = data[at] == MAGIC_V1
        header = HEADER_V1 if first else HEADER_V2
        counter = at + (2 if first else 4)
        system, component = data[counter + 1], data[counter + 2]
        before = sequence[system, component]
        if before >= 0:
            totals[LOST] += (np.int64(data[counter]) - before - 1) & 0xFF
        sequence[system, component] = data[counter]
        heard[system, component] += 1
        message = _message_id(data, at)
        if slots[message] >= 0:
            row = records[count]
            row["order"] = totals[FRAMES]
            row["stamp_us"] = stamp
            row["at"] = at + header
            row["length"] = data[at + 1]
            row["message"] = message
            row["system"] = system
            row["component"] = component
            count += 1
        totals[FRAMES] += 1
        end = at + length
    return end, count, searching


@njit(cache=True, nogil=True)
def _next_frame(
    data: NDArray[np.uint8], start: int, stop: int, tables: NDArray[np.uint16], extras: NDArray[np.int16]
) -> int:
    """Return where the first frame with a right checksum begins from `start` to before `stop`, or -1."""
    for at in range(start, min(stop, data.size)):
        if (data[at] == MAGIC_V2 or data[at] == MAGIC_V1) and _frame_length(data, at, tables, extras) > 0:
            return at
    return -1


@njit(cache=True, nogil=True)
def _frame_length(data: NDArray[np.uint8], at: int, tables: NDArray[np.uint16], extras: NDArray[np.int16]) -> int:
    """Return how long the frame at a place is; 0 when there is none, less when nobody knows its checksum."""
    if at + HEADER_V1 + CHECKSUM > data.size:
        return _BAD
    first = data[at] == MAGIC_V1
    if not first and data[at] != MAGIC_V2:
        return _BAD
    header = HEADER_V1 if first else HEADER_V2
    flags = 0 if first else int(data[at + 2])
    if flags & ~SIGNED:
        return _BAD
    covered = header + int(data[at + 1])
    length = covered + CHECKSUM + (SIGNATURE if flags else 0)
    if at + length > data.size:
        return _BAD
    message = _message_id(data, at)
    extra = int(extras[message]) if message < IDS else -1
    if extra < 0:
        return -length
    crc = _checksum(data, at + 1, at + covered, tables)
    right = crc >> 8 ^ np.int64(tables[0, (crc ^ extra) & 0xFF])
    return length if right == np.int64(data[at + covered]) | np.int64(data[at + covered + 1]) << 8 else _BAD


@njit(cache=True, nogil=True)
def _checksum(data: NDArray[np.uint8], start: int, end: int, tables: NDArray[np.uint16]) -> int:
    """Return CRC-16/MCRF4XX, eight bytes at a time: their shares do not wait for each other (slicing by 8)."""
    crc = np.int64(0xFFFF)
    at = start
    while at + _AT_ONCE <= end:
        crc = (
            np.int64(tables[7, (crc ^ data[at]) & 0xFF])
            ^ np.int64(tables[6, crc >> 8 ^ data[at + 1]])
            ^ np.int64(tables[5, data[at + 2]])
            ^ np.int64(tables[4, data[at + 3]])
            ^ np.int64(tables[3, data[at + 4]])
            ^ np.int64(tables[2, data[at + 5]])
            ^ np.int64(tables[1, data[at + 6]])
            ^ np.int64(tables[0, data[at + 7]])
        )
        at += _AT_ONCE
    while at < end:
        crc = crc >> 8 ^ np.int64(tables[0, (crc ^ data[at]) & 0xFF])
        at += 1
    return int(crc)


@njit(cache=True, nogil=True)
def _message_id(data: NDArray[np.uint8], at: int) -> int:
    if data[at] == MAGIC_V1:
        return int(data[at + 5])
    return int(data[at + 7]) | int(data[at + 8]) << 8 | int(data[at + 9]) << 16


@njit(cache=True, nogil=True)
def _stamp_us(data: NDArray[np.uint8], at: int, end: int) -> np.uint64:
    """Return the stamp before a frame; 0 when the record before reaches into it."""
    stamp = np.uint64(0)
    if at - STAMP >= end:
        for place in range(at - STAMP, at):
            stamp = stamp << np.uint64(8) | np.uint64(data[place])
    return stamp


@njit(cache=True, nogil=True)
def grouped(
    records: np.ndarray, slots: NDArray[np.int16], numbers: NDArray[np.int32], kinds: int
) -> tuple[NDArray[np.int32], NDArray[np.int32], NDArray[np.int32]]:
    """Put the records of a kind and a sender side by side.

    Parameters
    ----------
    records : array of RECORD (n,)
    slots : array of int16 (IDS,)
        A wanted message's place among the wanted ones, 0..kinds - 1; -1 for the others.
    numbers : array of int32 (65536 * kinds,)
        All 0, and so it is left.
    kinds : int

    Returns
    -------
    rows : array of int32 (n,)
        Rows of `records`, group by group, in each in their order.
    firsts : array of int32 (g,)
        A record of each group.
    ends : array of int32 (g,)
        Where each group ends in `rows`.
    """
    firsts = np.empty(records.size, dtype=np.int32)
    counts = np.zeros(records.size, dtype=np.int32)
    groups = np.empty(records.size, dtype=np.int32)
    found = 0
    for row in range(records.size):
        one = records[row]
        key = (np.int64(one["system"]) << 8 | np.int64(one["component"])) * kinds + slots[one["message"]]
        if numbers[key] == 0:
            firsts[found] = row
            found += 1
            numbers[key] = found
        groups[row] = numbers[key] - 1
        counts[groups[row]] += 1
    ends = np.cumsum(counts[:found]).astype(np.int32)
    places = ends - counts[:found]
    rows = np.empty(records.size, dtype=np.int32)
    for row in range(records.size):
        group = groups[row]
        rows[places[group]] = row
        places[group] += 1
    for group in range(found):
        one = records[firsts[group]]
        numbers[(np.int64(one["system"]) << 8 | np.int64(one["component"])) * kinds + slots[one["message"]]] = 0
    return rows, firsts[:found], ends


@njit(cache=True, nogil=True)
def gather(data: NDArray[np.uint8], records: np.ndarray, rows: NDArray[np.int32], fields: NDArray[np.uint8]) -> None:
    """Fill `fields` (n, width), zeros so far, with payloads; MAVLink 2 leaves out zeros at the end."""
    width = fields.shape[1]
    for row in range(rows.size):
        one = records[rows[row]]
        start = one["at"]
        for column in range(min(width, np.int64(one["length"]))):
            fields[row, column] = data[start + column]
