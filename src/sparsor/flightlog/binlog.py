"""The log an ArduPilot vehicle keeps of itself."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from typing import TYPE_CHECKING, Final

import numpy as np

from sparsor.flightlog.dataflash import Dataflash
from sparsor.flightlog.log import AMBIENT, AUTOPILOT, Damage, NamedValues, Places, Sender
from sparsor.flightlog.recording import Fixes, Happening, Recording, Ticks, UnixTimes, changes
from sparsor.flightlog.selfdescribed import Format, Messages
from sparsor.flightlog.texts import rows_by_text, text_of
from sparsor.flightlog.thinning import APART_S, CLOCK_S, PLACE_DEG, PLACE_M, WHOLE, Course, Rows, ThinnedRows

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from numpy.typing import NDArray

# ArduPilot's own messages that hold a latitude: positions, targets and traffic, not measurements.
_OWN_PLACES: Final = frozenset(
    (
        *("ADSB", "AHR2", "AIS1", "AIS4", "AIS5", "BCN", "CAM", "CMD", "FNCE", "FOLL", "GPS", "GPS2", "GPSB", "LAND"),
        *("MISE", "OABR", "OADJ", "ORGN", "POS", "RALY", "SIM", "TERR", "TRIG"),
    )
)
_ALWAYS: Final = frozenset(("POS", "GPS", "NVAL", "NVF", "MODE", "MSG", "CMD", "MISE", "EV", "ARM", "BARO", "PARM"))
_PLACE_COLUMNS: Final = ("Lat", "Lng", "Alt")
_TIME_COLUMNS: Final = ("TimeUS", "TimeMS", "TimeBootMS")
_SYSTEM_PARAMETERS: Final = ("SYSID_THISMAV", "MAV_SYSID")
_ARMED, _DISARMED, _LAND_COMPLETE, _NOT_LANDED = 10, 11, 18, 28  # AP_Logger's LogEvent
_ON_GROUND, _IN_AIR = 1, 2  # MAV_LANDED_STATE
_GPS_EPOCH_S, _WEEK_S, _LEAP_S = 315_964_800.0, 604_800.0, 18.0
_FIX_3D = 3
_INFO = 6  # the severity of a text, which this log does not keep
_REACHED = re.compile(r"Reached command #(\d+)")


def read_bin(blocks: Iterable[bytes], sensor: str | None = None, whole: int = WHOLE) -> Recording:
    """Return what a .BIN file holds.

    Parameters
    ----------
    blocks : iterable of bytes
        The file in pieces of any size.
    sensor : str, optional
        A MSG.FIELD to read as well. Those of messages with a position of their own are always read.
    whole : int
        So many positions and readings of the clock are kept as they are; of more, see `thinning`.
    """
    asked = sensor.partition(".")[0] if sensor and "." in sensor else None

    def kept_in(one: Format) -> Rows | None:
        if one.name == "POS" != asked and {"TimeUS", *_PLACE_COLUMNS} <= set(one.numeric()):
            return _positions(one, whole)
        return Rows() if one.name in _ALWAYS or one.name == asked or _has_own_place(one) else None

    file = Dataflash(blocks, kept_in)
    messages = file.messages
    system = _system_id(messages.get("PARM"))
    recording = Recording("BIN", fields=tuple(_fields(file)))
    recording.heard = {Sender(system, AUTOPILOT): file.count}
    recording.damage = Damage(file.damaged, file.skipped)
    recording.ticks[system] = _ticks(messages.values(), whole)
    for name in ("POS", "GPS"):
        if name in messages and all(column in messages[name] for column in _PLACE_COLUMNS):
            recording.fixes[system, name] = _fixes(messages[name])
    if "GPS" in messages:
        recording.unix[system] = _unix(messages["GPS"])
    recording.happenings = list(_happenings(system, messages))
    recording.values = [*_named(system, messages), *_columns(system, messages, sensor)]
    for values in recording.values:
        recording.heard.setdefault(values.sender, values.order.size)
    return recording


def _positions(one: Format, whole: int) -> ThinnedRows:
    """Return what collects POS, which a long log has far more often than is of use."""
    names = [name for name in ("Lng", "Lat", "Alt", "RelHomeAlt") if name in one.numeric()]
    within = {"Lng": PLACE_DEG, "Lat": PLACE_DEG, "Alt": PLACE_M, "RelHomeAlt": PLACE_M}

    def course(order: NDArray[np.int64], rows: np.ndarray) -> Course:
        messages = Messages(one, order, rows)
        across = np.stack([messages.column(name) for name in names], axis=1)
        return Course(messages.time_s, across, (across[:, :2] == 0).all(axis=1).astype(np.int64))

    return ThinnedRows(course, tuple(within[name] for name in names), APART_S, whole)


def _has_own_place(one: Format) -> bool:
    return one.name not in _OWN_PLACES and {"Lat", "Lng"} <= set(one.columns)


def _fields(file: Dataflash) -> Iterator[str]:
    for name, one in sorted(file.formats.items()):
        for column in one.numeric():
            if column not in _TIME_COLUMNS:
                yield f"{name}.{column}"


def _system_id(parameters: Messages | None) -> int:
    """Return the vehicle's system id, which only its parameters tell; 1, as they are delivered, without them."""
    if parameters is not None and "Name" in parameters and "Value" in parameters:
        for name, value in zip(parameters.rows["Name"].tolist(), parameters.column("Value").tolist(), strict=True):
            if text_of(name) in _SYSTEM_PARAMETERS and 1 <= value <= 255:
                return int(value)
    return 1


def _ticks(messages: Iterable[Messages], whole: int) -> Ticks:
    timed = [one for one in messages if "TimeUS" in one or "TimeMS" in one]
    order = np.concatenate([np.zeros(0, np.int64), *(one.order for one in timed)])
    time_s = np.concatenate([np.zeros(0), *(one.time_s for one in timed)])
    rows = np.argsort(order, kind="stable")
    clock = ThinnedRows(_clock_course, (CLOCK_S,), math.inf, whole)  # between them the number of messages divides time
    clock.add(order[rows], time_s[rows])
    columns = clock.joined()
    if not columns:
        return Ticks(order, time_s, time_s)
    return Ticks(columns[0], np.full(columns[0].size, np.nan), columns[1])


def _clock_course(order: NDArray[np.int64], time_s: NDArray[np.float64]) -> Course:
    return Course(order.astype(np.float64), time_s[:, None], np.zeros(order.size, dtype=np.int64))


def _fixes(one: Messages) -> Fixes:
    has_fix = np.ones(one.order.size, dtype=np.bool_)
    if "Status" in one:
        has_fix = one.column("Status") >= _FIX_3D
    if "I" in one:  # the second receiver may stand elsewhere
        has_fix &= one.column("I") == 0
    return Fixes(one.order, np.full(one.order.size, np.nan), one.time_s, _places(one), has_fix, one.stands_for)


def _places(one: Messages) -> Places:
    unknown = np.full(one.order.size, np.nan)
    alt_m = one.column("Alt") if "Alt" in one else unknown
    height_m = one.column("RelHomeAlt") if "RelHomeAlt" in one else unknown
    return Places(one.column("Lng"), one.column("Lat"), alt_m, height_m)


def _unix(gps: Messages) -> UnixTimes:
    if "GMS" not in gps or "GWk" not in gps:
        return UnixTimes(np.zeros(0, np.int64), np.zeros(0))
    week = gps.column("GWk")
    unix_s = _GPS_EPOCH_S + week * _WEEK_S + gps.column("GMS") / 1e3 - _LEAP_S
    valid = week > 0
    return UnixTimes(gps.order[valid], (unix_s - gps.time_s)[valid])


def _happenings(system: int, messages: dict[str, Messages]) -> Iterator[Happening]:
    nan = float("nan")

    def at(one: Messages, row: int, kind: str, value: int = 0, text: str = "") -> Happening:
        return Happening(int(one.order[row]), nan, system, kind, value, text)

    modes = messages.get("MODE")
    if modes is not None and "ModeNum" in modes:
        for row in changes(modes.rows["ModeNum"]):
            yield at(modes, row, "mode", int(modes.rows["ModeNum"][row]))
    events = messages.get("EV")
    if events is not None and "Id" in events:
        landed = {_LAND_COMPLETE: _ON_GROUND, _NOT_LANDED: _IN_AIR}
        armed = {} if "ARM" in messages else {_ARMED: "armed", _DISARMED: "disarmed"}
        for row, number in enumerate(events.rows["Id"].tolist()):
            if number in landed:
                yield at(events, row, "landed_state", landed[number])
            elif number in armed:
                yield at(events, row, armed[number])
    arms = messages.get("ARM")
    if arms is not None and "ArmState" in arms:
        for row, state in enumerate(arms.rows["ArmState"].tolist()):
            yield at(arms, row, "armed" if state else "disarmed")
    items = messages.get("MISE", messages.get("CMD"))
    if items is not None and "CNum" in items:
        numbers = items.rows["CNum"].astype(np.int64)
        flown = np.flatnonzero(~_listed(numbers))
        for row in flown[changes(numbers[flown])]:
            yield at(items, row, "item_current", int(numbers[row]))
    said = messages.get("MSG")
    if said is not None and "Message" in said:
        for row, raw in enumerate(said.rows["Message"].tolist()):
            text = text_of(raw)
            yield at(said, row, "text", _INFO, text)
            if reached := _REACHED.search(text):
                yield at(said, row, "item_reached", int(reached[1]))


def _listed(numbers: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Return which items were not begun, only listed with the mission: those that count up from 0, which is home."""
    rows = np.arange(numbers.size)
    home = np.maximum.accumulate(np.where(numbers == 0, rows, -1))
    counted = (home >= 0) & (numbers == rows - home)
    broken = np.maximum.accumulate(np.where(counted, -1, rows))
    return np.asarray(counted & (broken < home), dtype=np.bool_)


def _named(system: int, messages: dict[str, Messages]) -> Iterator[NamedValues]:
    """Yield the named values: NVAL were received (with the sender's stamp), NVF were sent."""
    for kind in ("NVAL", "NVF"):
        one = messages.get(kind)
        if one is None or "Name" not in one or "Value" not in one:
            continue
        named = sorted(rows_by_text(one.rows["Name"]), key=lambda pair: pair[0])
        size = one.order.size
        senders = _numbers(one, "SSys", system) << 8 | _numbers(one, "SCom", AUTOPILOT)
        stamp_s = one.column("TimeBootMS") / 1e3 if "TimeBootMS" in one else one.time_s
        value = one.column("Value")
        for name, of_name in named:
            rows = np.arange(size)[of_name]
            for who in np.unique(senders[rows]).tolist():
                own = rows[senders[rows] == who]
                yield _column(Sender(*divmod(who, 256)), name, one, stamp_s, value).take(own)


def _numbers(one: Messages, column: str, otherwise: int) -> NDArray[np.int64]:
    """Return a column of system or component ids; what no id can be is 0."""
    if column not in one:
        return np.full(one.order.size, otherwise, dtype=np.int64)
    values = one.column(column)
    return np.where((values >= 0) & (values < 256), values, 0).astype(np.int64)


def _columns(system: int, messages: dict[str, Messages], sensor: str | None) -> Iterator[NamedValues]:
    sender = Sender(system, AUTOPILOT)
    for name, one in messages.items():
        if name in _ALWAYS or not _has_own_place(one.format):
            continue
        for column in one.format.numeric():
            if column not in (*_PLACE_COLUMNS, *_TIME_COLUMNS):
                yield _column(sender, f"{name}.{column}", one, one.time_s, one.column(column), _places(one))
    name, _, column = (sensor or "").partition(".")
    if name in messages and column in messages[name].format.numeric() and not _has_own_place(messages[name].format):
        yield _column(sender, f"{name}.{column}", messages[name], messages[name].time_s, messages[name].column(column))
    air = messages.get("BARO")
    if air is not None and "Press" in air and "Temp" in air:
        first = air.column("I") == 0 if "I" in air else np.ones(air.order.size, dtype=np.bool_)
        for title, values in (("press_abs", air.column("Press") / 100.0), ("temperature", air.column("Temp"))):
            yield replace(_column(sender, title, air, air.time_s, values).take(first), message=AMBIENT)


def _column(
    sender: Sender,
    name: str,
    one: Messages,
    stamp_s: NDArray[np.float64],
    value: NDArray[np.float64],
    places: Places | None = None,
) -> NamedValues:
    # What a vehicle received or sent as NAMED_VALUE_FLOAT is the same series here and in the ground station's log.
    message = "NAMED_VALUE_FLOAT" if one.format.name in ("NVAL", "NVF") else one.format.name
    return NamedValues(sender, message, name, one.order, np.full(one.order.size, np.nan), stamp_s, value, places)
