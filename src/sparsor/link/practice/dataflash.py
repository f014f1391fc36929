"""ArduPilot's dataflash log: records that the log itself describes.

A record is two bytes of magic, the number of its kind and its fields, little-endian and without padding. FMT
records say which fields each kind has, FMTU records their units, UNIT and MULT what the letters in those mean.
Numbers, fields, units and multipliers are those in a log of ArduCopter 4.6.2 (LogStructure.h).
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Iterator

MAGIC: Final = b"\xa3\x95"
# What `struct` calls a field's letter, and what a value is multiplied by on its way into it.
LETTERS: Final[dict[str, tuple[str, float]]] = {
    "b": ("b", 1), "B": ("B", 1), "h": ("h", 1), "H": ("H", 1), "i": ("i", 1), "I": ("I", 1), "Q": ("Q", 1),
    "f": ("f", 1), "d": ("d", 1), "M": ("B", 1), "n": ("4s", 1), "N": ("16s", 1), "Z": ("64s", 1),
    "c": ("h", 100), "C": ("H", 100), "e": ("i", 100), "E": ("I", 100), "L": ("i", 1e7),
}  # fmt: skip
WHOLE: Final = frozenset("bBhHiIQ")
UNITS: Final = {
    "-": "", "s": "s", "#": "instance", "D": "deglatitude", "U": "deglongitude", "m": "m", "n": "m/s",
    "h": "degheading",
    "d": "deg", "S": "satellites", "v": "V", "A": "A", "a": "Ah", "X": "W.h", "O": "degC", "w": "Ohm", "%": "%",
    "b": "B",
}  # fmt: skip
MULTIPLIERS: Final = {"-": 0.0, "?": 1.0, "0": 1.0, "B": 1e-2, "C": 1e-3, "F": 1e-6, "G": 1e-7}


@dataclass(frozen=True)
class Kind:
    """One kind of record.

    Parameters
    ----------
    number : int
        In the third byte of its records.
    name : str
    letters : str
        One a field, as in `LETTERS`.
    fields : str
        Names, with commas.
    units, multipliers : str
        One letter a field, as in `UNITS` and `MULTIPLIERS`.
    """

    number: int
    name: str
    letters: str
    fields: str
    units: str
    multipliers: str

    @cached_property
    def layout(self) -> struct.Struct:
        """The fields of a record, behind its three bytes."""
        return struct.Struct("<" + "".join(LETTERS[letter][0] for letter in self.letters))

    def record(self, *values: float | str | bytes) -> bytes:
        """Return a record of values in their own units; numbers beyond a field's range become its nearest.

        Examples
        --------
        >>> KINDS["MODE"].record(1_000_000, 3, 3, 0).hex()
        'a3957a40420f0000000000030300'
        """
        given = zip(self.letters, values, strict=True)
        return MAGIC + bytes([self.number]) + self.layout.pack(*(_field(letter, value) for letter, value in given))


def _field(letter: str, value: float | str | bytes) -> float | bytes:
    if isinstance(value, str):
        return value.encode("ascii", "replace")
    if isinstance(value, bytes):
        return value
    code, scale = LETTERS[letter]
    if code not in WHOLE:
        return value * scale
    bits = 8 * struct.calcsize(code)
    low, high = (0, (1 << bits) - 1) if code.isupper() else (-1 << (bits - 1), (1 << (bits - 1)) - 1)
    return min(max(round(value * scale), low), high)


KINDS: Final = {
    kind.name: kind
    for kind in (
        Kind(128, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns", "-b---", "-----"),
        Kind(119, "UNIT", "QbZ", "TimeUS,Id,Label", "s--", "F--"),
        Kind(120, "MULT", "Qbd", "TimeUS,Id,Mult", "s--", "F--"),
        Kind(118, "FMTU", "QBNN", "TimeUS,FmtType,UnitIds,MultIds", "s---", "F---"),
        Kind(32, "PARM", "QNff", "TimeUS,Name,Value,Default", "s---", "F---"),
        Kind(59, "MSG", "QZ", "TimeUS,Message", "s-", "F-"),
        Kind(122, "MODE", "QMBB", "TimeUS,Mode,ModeNum,Rsn", "s---", "F---"),
        Kind(
            93, "CMD", "QHHHffffLLfB", "TimeUS,CTot,CNum,CId,Prm1,Prm2,Prm3,Prm4,Lat,Lng,Alt,Frame",
            "s-------DUm-", "F-------GG0-",
        ),
        Kind(73, "ORGN", "QBLLe", "TimeUS,Type,Lat,Lng,Alt", "s#DUm", "F-GGB"),
        Kind(181, "EV", "QB", "TimeUS,Id", "s-", "F-"),
        Kind(186, "ARM", "QBIBB", "TimeUS,ArmState,ArmChecks,Forced,Method", "s----", "F----"),
        Kind(
            94, "GPS", "QBBIHBcLLeffffB", "TimeUS,I,Status,GMS,GWk,NSats,HDop,Lat,Lng,Alt,Spd,GCrs,VZ,Yaw,U",
            "s#-s-S-DUmnhnh-", "F--C-0BGGB000--",
        ),
        Kind(74, "POS", "QLLfff", "TimeUS,Lat,Lng,Alt,RelHomeAlt,RelOriginAlt", "sDUmmm", "FGG000"),
        Kind(72, "ATT", "QffffffB", "TimeUS,DesRoll,Roll,DesPitch,Pitch,DesYaw,Yaw,AEKF", "sddddhh-", "F000000-"),
        Kind(
            88, "BAT", "QBfffffcfBBB", "TimeUS,Inst,Volt,VoltR,Curr,CurrTot,EnrgTot,Temp,Res,RemPct,H,SH",
            "s#vvAaXOw%-%", "F-000C0?0000",
        ),
        Kind(247, "NVAL", "QINfBB", "TimeUS,TimeBootMS,Name,Value,SSys,SCom", "ss#---", "FC----"),
    )
}  # fmt: skip


def describing_records(time_us: int) -> Iterator[bytes]:
    """Yield the records that a log begins with: every kind's format, then units, multipliers and who has which."""
    write = {name: kind.record for name, kind in KINDS.items()}
    for kind in KINDS.values():
        length = len(MAGIC) + 1 + kind.layout.size
        yield write["FMT"](kind.number, length, kind.name, kind.letters, kind.fields)
    for letter, label in UNITS.items():
        yield write["UNIT"](time_us, ord(letter), label)
    for letter, factor in MULTIPLIERS.items():
        yield write["MULT"](time_us, ord(letter), factor)
    for kind in KINDS.values():
        yield write["FMTU"](time_us, kind.number, kind.units, kind.multipliers)
