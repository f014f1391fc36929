"""The frames of a .tlog found in blocks of bytes, compiled: a hundred times faster than one frame at a time.

A .tlog is a row of records: 8 bytes of big-endian microseconds since 1970, then a frame. What `mavlink_frames` says
about frames holds here too; what differs is the space between them, and that frames of messages which the dialect
does not know are only counted.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Final

import numpy as np
from numba import njit

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
    from collections.abc import Collection

    from numpy.typing import NDArray

STAMP: Final = 8
IDS: Final = 1 << 16  # every message of the dialect has a smaller number
_AHEAD: Final = 2 * (STAMP + LONGEST)  # what lies this far from the end may need bytes that are still to come
_BAD, _UNKNOWN = 0, -1
_FRAMES, _SKIPPED, _DAMAGED, _STRANGE, _LOST = range(5)
_DAY_US = 86_400_000_000
_AT_ONCE: Final = 8

RECORD = np.dtype(
    [
        ("order", np.int64),
        ("stamp_us", np.uint64),
        ("at", np.int64),
        ("length", np.int64),
        ("message", np.int32),
        ("system", np.uint8),
        ("component", np.uint8),
    ]
)
"""One wanted frame: its number among all frames, the stamp before it, place and length of the payload, its sender."""


@dataclass(frozen=True, eq=False)
class Block:
    """The wanted frames of a block of the file.

    Parameters
    ----------
    data : array of uint8
    records : array of RECORD
        Their `at` points into `data`.
    """

    data: NDArray[np.uint8]
    records: np.ndarray

    def payloads(self, message: int, layout: np.dtype[np.void]) -> tuple[np.ndarray, np.ndarray]:
        """Return the records of one kind of message and their fields; missing bytes at the end are zeros."""
        records = self.records[self.records["message"] == message]
        fields = np.zeros((records.size, layout.itemsize), dtype=np.uint8)
        _gather(self.data, records["at"], records["length"], fields)
        return records, fields.view(layout)[:, 0]


class TlogScanner:
    """Takes a .tlog block by block and finds the frames in it.

    What is found does not depend on how the file was cut into blocks. Behind damage every byte may begin a frame, and
    every frame whose checksum is right is taken: a frame that survived is found, and one in 65 536 false
    beginnings passes for one.

    Parameters
    ----------
    wanted : collection of int
        Message ids that are returned; all others are only counted.

    Examples
    --------
    >>> beat = bytes.fromhex("fd0900000001010000000000000002030003034f5b")
    >>> scanner = TlogScanner({0})
    >>> scanner.feed(b"damage" + bytes(8) + beat, ended=True).records["system"]
    array([1], dtype=uint8)
    >>> scanner.frames, scanner.skipped
    (1, 6)
    """

    def __init__(self, wanted: Collection[int]) -> None:
        self._wanted = np.zeros(IDS, dtype=np.bool_)
        self._wanted[list(wanted)] = True
        self._rest = np.zeros(0, dtype=np.uint8)
        self._totals = np.zeros(5, dtype=np.int64)
        self._heard = np.zeros((256, 256), dtype=np.int64)
        self._sequence = np.full((256, 256), -1, dtype=np.int16)
        self._stamp = np.zeros(1, dtype=np.uint64)
        self._searching = False

    def feed(self, data: bytes, *, ended: bool) -> Block:
        """Take the next block, the last one if `ended`; return what is complete now."""
        block = np.concatenate((self._rest, np.frombuffer(data, dtype=np.uint8)))
        records = np.empty(block.size // (HEADER_V1 + CHECKSUM) + 1, dtype=RECORD)
        at, count, self._searching = _scan(
            block,
            ended,
            self._searching,
            checksum_tables(),
            extras_table(),
            self._wanted,
            self._totals,
            self._heard,
            self._sequence,
            self._stamp,
            records,
        )
        self._rest = block[at:].copy()
        return Block(block, records[:count].copy())

    @property
    def frames(self) -> int:
        """Frames of known messages so far, wanted or not."""
        return int(self._totals[_FRAMES])

    @property
    def skipped(self) -> int:
        """Bytes that belonged to no record."""
        return int(self._totals[_SKIPPED])

    @property
    def damaged(self) -> int:
        """Places where a record was due and none stood."""
        return int(self._totals[_DAMAGED])

    @property
    def unknown(self) -> int:
        """Frames of messages that the dialect lacks."""
        return int(self._totals[_STRANGE])

    @property
    def lost(self) -> int:
        """Frames that the senders' counters say are missing (a gap of more than 255 counts for less)."""
        return int(self._totals[_LOST])

    def heard(self) -> dict[tuple[int, int], int]:
        """Return system and component of every sender to the number of its frames."""
        return {(int(s), int(c)): int(self._heard[s, c]) for s, c in zip(*np.nonzero(self._heard), strict=True)}


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
def _scan(
    data: NDArray[np.uint8],
    ended: bool,
    searching: bool,
    tables: NDArray[np.uint16],
    extras: NDArray[np.int16],
    wanted: NDArray[np.bool_],
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
            if length < _BAD and _next_frame(data, at + 1, at - length, tables, extras) < 0:
                totals[_STRANGE] += 1
                end = at - length
                continue
            if length <= _BAD:
                totals[_DAMAGED] += 1
                searching = True
        if searching:
            at = _next_frame(data, end, stop, tables, extras)
            if at < 0:
                left = size if ended else max(end, stop - STAMP)
                totals[_SKIPPED] += left - end
                end = left
                break
            length = _frame_length(data, at, tables, extras)
            totals[_SKIPPED] += max(at - STAMP - end, 0)
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
            totals[_LOST] += (np.int64(data[counter]) - before - 1) & 0xFF
        sequence[system, component] = data[counter]
        heard[system, component] += 1
        message = _message_id(data, at)
        if wanted[message]:
            row = records[count]
            row["order"] = totals[_FRAMES]
            row["stamp_us"] = stamp
            row["at"] = at + header
            row["length"] = data[at + 1]
            row["message"] = message
            row["system"] = system
            row["component"] = component
            count += 1
        totals[_FRAMES] += 1
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
    flags = 0 if first else data[at + 2]
    if flags & ~SIGNED:
        return _BAD
    covered = header + int(data[at + 1])
    length = covered + CHECKSUM + (SIGNATURE if flags else 0)
    if at + length > data.size:
        return _BAD
    message = _message_id(data, at)
    extra = extras[message] if message < IDS else -1
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
def _gather(
    data: NDArray[np.uint8], starts: NDArray[np.int64], lengths: NDArray[np.int64], fields: NDArray[np.uint8]
) -> None:
    rows, width = fields.shape
    for row in range(rows):
        for column in range(min(width, lengths[row])):
            fields[row, column] = data[starts[row] + column]
