"""ArduPilot's own log (.BIN): messages that describe themselves, found and decoded.

A message is A3 95, its type and its fields; a message of type 128 (FMT) gives a type its length, name, format and
column names. There is no checksum: a message is believed when its length leads to the next one.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np
from numba import njit

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from numpy.typing import NDArray

HEAD: Final = 3
_HEAD_1, _HEAD_2, _FMT = 0xA3, 0x95, 128
_FMT_LENGTH = 89
_LONGEST = 256
_SKIPPED, _DAMAGED, _MESSAGES = range(3)
_FMT_LAYOUT = np.dtype([("type", "u1"), ("length", "u1"), ("name", "S4"), ("format", "S16"), ("columns", "S64")])
# Format letters to numpy codes and what one count is worth (AP_Logger's structure).
_CODES: Final[dict[str, tuple[str, float]]] = {
    "a": ("<32i2", 1.0),
    "b": ("i1", 1.0),
    "B": ("u1", 1.0),
    "h": ("<i2", 1.0),
    "H": ("<u2", 1.0),
    "i": ("<i4", 1.0),
    "I": ("<u4", 1.0),
    "f": ("<f4", 1.0),
    "d": ("<f8", 1.0),
    "g": ("<f2", 1.0),
    "n": ("S4", 0.0),
    "N": ("S16", 0.0),
    "Z": ("S64", 0.0),
    "c": ("<i2", 0.01),
    "C": ("<u2", 0.01),
    "e": ("<i4", 0.01),
    "E": ("<u4", 0.01),
    "L": ("<i4", 1e-7),
    "M": ("u1", 1.0),
    "q": ("<i8", 1.0),
    "Q": ("<u8", 1.0),
}


@dataclass(frozen=True)
class Format:
    """What an FMT message says of a type.

    Parameters
    ----------
    number : int
        The type.
    length : int
        Bytes, with the head.
    name : str
    letters : str
        One a column.
    columns : tuple of str
    """

    number: int
    length: int
    name: str
    letters: str
    columns: tuple[str, ...]

    @property
    def layout(self) -> np.dtype[np.void] | None:
        """Return the fields as they lie in the message; None when the FMT message is not consistent."""
        known = all(letter in _CODES for letter in self.letters)
        if not known or len(self.letters) != len(self.columns) or len(set(self.columns)) != len(self.columns):
            return None
        fields = [(name, _CODES[letter][0]) for name, letter in zip(self.columns, self.letters, strict=True)]
        try:
            layout = np.dtype(fields)
        except (ValueError, TypeError):  # a column without a name
            return None
        return layout if layout.itemsize == self.length - HEAD else None

    def numeric(self) -> tuple[str, ...]:
        """Return the columns that hold one number."""
        pairs = zip(self.columns, self.letters, strict=False)
        return tuple(name for name, letter in pairs if letter != "a" and _CODES.get(letter, ("", 0.0))[1] > 0)


@dataclass(frozen=True, eq=False)
class Messages:
    """All messages of one name.

    Parameters
    ----------
    format : Format
    order : array of int64 (n,)
        Places in the log.
    rows : structured array (n,)
    """

    format: Format
    order: NDArray[np.int64]
    rows: np.ndarray

    def __contains__(self, column: str) -> bool:
        return column in self.format.columns

    def column(self, name: str) -> NDArray[np.float64]:
        """Return a numeric column in the unit of its format letter (degrees, or the message's own)."""
        scale = _CODES[self.format.letters[self.format.columns.index(name)]][1]
        with np.errstate(invalid="ignore"):  # damage makes numbers that are none
            return np.asarray(self.rows[name].astype(np.float64) * scale, dtype=np.float64)

    @property
    def time_s(self) -> NDArray[np.float64]:
        """Seconds since boot, from TimeUS or, in old logs, TimeMS."""
        if "TimeUS" in self:
            return self.column("TimeUS") / 1e6
        return self.column("TimeMS") / 1e3 if "TimeMS" in self else np.full(self.order.size, np.nan)


class Dataflash:
    """The messages of a .BIN file, read once.

    Parameters
    ----------
    blocks : iterable of bytes
        The file in pieces of any size.
    wanted : callable
        Whether the messages of a format are kept.

    Attributes
    ----------
    formats : dict of str to Format
        By name.
    messages : dict of str to Messages
        By name; the wanted ones.
    count, skipped, damaged : int
        Messages of all kinds, bytes that belonged to none, places where one was due and none stood.
    """

    def __init__(self, blocks: Iterable[bytes], wanted: Callable[[Format], bool]) -> None:
        self.formats: dict[str, Format] = {}
        self._wanted: dict[int, Format] = {}
        self._accept = wanted
        self._parts: dict[int, list[tuple[NDArray[np.int64], np.ndarray]]] = {}
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
            one = self._wanted.get(number)
            layout = one.layout if one is not None else None
            if layout is not None:
                chosen = np.flatnonzero(kinds == number)
                order = (first + chosen).astype(np.int64)
                self._parts.setdefault(number, []).append((order, _gathered(block, places[chosen], layout)))

    def _describe(self, fields: np.void) -> None:
        name, letters, columns = (
            bytes(fields[key]).partition(b"\x00")[0].decode("ascii", "replace") for key in ("name", "format", "columns")
        )
        one = Format(int(fields["type"]), int(fields["length"]), name, letters, tuple(columns.split(",")))
        if one.name not in self.formats and one.number not in self._wanted and one.layout is not None:
            self.formats[name] = one
            if self._accept(one):
                self._wanted[one.number] = one

    def _joined(self) -> Iterator[tuple[str, Messages]]:
        for number, one in self._wanted.items():
            parts = self._parts.get(number)
            if parts:
                order, rows = (np.concatenate([part[k] for part in parts]) for k in (0, 1))
                yield one.name, Messages(one, order, rows)


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
