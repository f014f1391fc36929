"""Messages that describe themselves: what the FMT messages of a .BIN file say of the others, and columns by that."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

HEAD: Final = 3
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
    stands_for : array of int32 (n,), optional
        As in `Fixes`.
    """

    format: Format
    order: NDArray[np.int64]
    rows: np.ndarray
    stands_for: NDArray[np.int32] | None = None

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
