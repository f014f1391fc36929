"""ArduPilot's own log (.BIN): messages that describe themselves, found and decoded.

A message is A3 95, its type and its fields; a message of type 128 (FMT) gives a type its length, name, format and
column names. There is no checksum: a message is believed when its length leads to the next one.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sparsor.core.compiled import njit
from sparsor.flightlog.selfdescribed import HEAD, Format, Messages

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from numpy.typing import NDArray

    from sparsor.flightlog.thinning import Rows

_HEAD_1, _HEAD_2, _FMT = 0xA3, 0x95, 128
_FMT_LENGTH = 89
_LONGEST = 256
_SKIPPED, _DAMAGED, _MESSAGES = range(3)
_FMT_LAYOUT = np.dtype([("type", "u1"), ("length", "u1"), ("name", "S4"), ("format", "S16"), ("columns", "S64")])


class Dataflash:
    """The messages of a .BIN file, read once.

    Parameters
    ----------
    blocks : iterable of bytes
        The file in pieces of any size.
    kept_in : callable
        Given a format, returns what its messages are collected in (order and fields, as `Rows` takes them); None when
        they are not wanted.

    Attributes
    ----------
    formats : dict of str to Format
        By name.
    messages : dict of str to Messages
        By name; the wanted ones.
    count, skipped, damaged : int
        Messages of all kinds, bytes that belonged to none, places where one was due and none stood.
    """

    def __init__(self, blocks: Iterable[bytes], kept_in: Callable[[Format], Rows | None]) -> None:
        self.formats: dict[str, Format] = {}
        self._wanted: dict[int, tuple[Format, np.dtype[np.void], Rows]] = {}
        self._kept_in = kept_in
        self._totals = np.zeros(3, dtype=np.int64)
        self._lengths = np.zeros(256, dtype=np.int64)
        self._lengths[_FMT] = _FMT_LENGTH
        self._read(blocks)
        self.messages = dict(self._joined())

    @property
    def count(self) -> int:
        """Messages of all kinds."""
        return int(self._totals[_MESSAGES])

    @property
    def skipped(self) -> int:
        """Bytes that belonged to no message."""
        return int(self._totals[_SKIPPED])

    @property
    def damaged(self) -> int:
        """Places where a message was due and none stood."""
        return int(self._totals[_DAMAGED])

    def _read(self, blocks: Iterable[bytes]) -> None:
        rest, searching = b"", False
        for data, ended in _with_last(blocks):
            block = np.frombuffer(rest + data, dtype=np.uint8)
            places = np.empty(block.size // HEAD + 1, dtype=np.int64)
            first = self.count
            at, count, searching = _scan(block, ended, searching, self._lengths, self._totals, places)
            self._keep(block, places[:count], first)
            rest = block[at:].tobytes()

    def _keep(self, block: NDArray[np.uint8], places: NDArray[np.int64], first: int) -> None:
        kinds = block[places + 2]
        for fields in _gathered(block, places[kinds == _FMT], _FMT_LAYOUT):
            self._describe(fields)
        for number in np.unique(kinds).tolist():
            if number in self._wanted:
                _, layout, rows = self._wanted[number]
                chosen = np.flatnonzero(kinds == number)
                rows.add((first + chosen).astype(np.int64), _gathered(block, places[chosen], layout))

    def _describe(self, fields: np.void) -> None:
        name, letters, columns = (
            bytes(fields[key]).partition(b"\x00")[0].decode("ascii", "replace") for key in ("name", "format", "columns")
        )
        one = Format(int(fields["type"]), int(fields["length"]), name, letters, tuple(columns.split(",")))
        if one.name in self.formats or one.number in self._wanted:
            return
        layout = one.layout
        if layout is not None:
            self.formats[name] = one
            rows = self._kept_in(one)
            if rows is not None:
                self._wanted[one.number] = (one, layout, rows)

    def _joined(self) -> Iterator[tuple[str, Messages]]:
        for one, _, rows in self._wanted.values():
            columns = rows.joined()
            if columns:
                yield one.name, Messages(one, *columns)


def _with_last(blocks: Iterable[bytes]) -> Iterator[tuple[bytes, bool]]:
    for block in blocks:
        yield block, False
    yield b"", True


def _gathered(block: NDArray[np.uint8], places: NDArray[np.int64], layout: np.dtype[np.void]) -> np.ndarray:
    columns = places[:, None] + HEAD + np.arange(layout.itemsize)
    return np.ascontiguousarray(block[columns]).view(layout)[:, 0]


@njit(cache=True, nogil=True)
def _scan(
    data: NDArray[np.uint8],
    ended: bool,
    searching: bool,
    lengths: NDArray[np.int64],
    totals: NDArray[np.int64],
    places: NDArray[np.int64],
) -> tuple[int, int, bool]:
    """Fill `places` with where messages begin; return where to go on, how many there are, and whether none is due."""
    size = data.size
    stop = size if ended else size - 2 * _LONGEST
    at = 0
    count = 0
    while at < stop:
        length = _message_length(data, at, lengths)
        if length == 0:
            if not searching:
                totals[_DAMAGED] += 1
            searching = True
            totals[_SKIPPED] += 1
            at += 1
            continue
        searching = False
        if data[at + 2] == _FMT:
            lengths[data[at + HEAD]] = data[at + HEAD + 1] if data[at + HEAD] != _FMT else _FMT_LENGTH
        places[count] = at
        count += 1
        totals[_MESSAGES] += 1
        at += length
    return at, count, searching


@njit(cache=True, nogil=True)
def _message_length(data: NDArray[np.uint8], at: int, lengths: NDArray[np.int64]) -> int:
    """Return how long the message at a place is, or 0 when none begins there that leads to another one."""
    size = data.size
    if at + HEAD > size or data[at] != _HEAD_1 or data[at + 1] != _HEAD_2:
        return 0
    length = lengths[data[at + 2]]
    after = at + length
    if length < HEAD or after > size:
        return 0
    ends = after == size or (data[after] == _HEAD_1 and (after + 1 == size or data[after + 1] == _HEAD_2))
    return length if ends else 0
