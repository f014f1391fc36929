"""The log a PX4 vehicle keeps of itself, read by pyulog."""

from __future__ import annotations

import contextlib
import io
import struct
from typing import TYPE_CHECKING, Any

import numpy as np

from sparsor.errors import LogError
from sparsor.flightlog.log import AMBIENT, AUTOPILOT, Damage, NamedValues, Places, Sender
from sparsor.flightlog.recording import Fixes, Happening, Recording, Ticks, UnixTimes, changes
from sparsor.flightlog.texts import rows_by_text
from sparsor.flightlog.ulogrepair import mended

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

MAGIC = b"ULog\x01\x12\x35"
TOPICS = (
    *("vehicle_global_position", "vehicle_gps_position", "sensor_gps", "home_position", "vehicle_air_data"),
    *("debug_key_value", "debug_vect", "debug_array", "vehicle_status", "vehicle_land_detected", "mission_result"),
)
_TIMES, _SPARE = 64, 1 << 20
_SYSTEM = 1  # PX4's own number as it is delivered
_FIX_3D = 3
_ARMED = 2  # vehicle_status.ARMING_STATE_ARMED
_ON_GROUND, _IN_AIR = 1, 2  # MAV_LANDED_STATE
_INFO = 6
Columns = dict[str, Any]


def read_ulog(contents: bytes) -> Recording:
    """Return what a .ulg file holds.

    Parameters
    ----------
    contents : bytes
        All of the file: its definitions are needed before its data.

    Raises
    ------
    LogError
        When pyulog makes nothing of it.
    """
    contents, skipped, places = mended(contents)
    file = _parsed(contents)
    recording = Recording("ulg")
    topics = [(one.name, one.data) for one in file.data_list if one.multi_id == 0 and _is_timed(one.data)]
    order = _Orders(topics)
    recording.heard = {Sender(_SYSTEM, AUTOPILOT): sum(data["timestamp"].size for _, data in topics)}
    recording.damage = Damage(max(places, int(file.file_corruption)), skipped, 0, len(file.dropouts))
    recording.ticks[_SYSTEM] = order.ticks
    by_name = dict(reversed(topics))  # the first of a name
    _add_positions(recording, by_name, order)
    recording.values = [*_named(by_name, order), *_air(by_name, order)]
    recording.happenings = [*_happenings(by_name, order), *_texts(file, order)]
    return recording


def _is_timed(data: Columns) -> bool:
    times_us = data.get("timestamp")  # a damaged description of the topic may lack it, or give it another type
    return times_us is not None and times_us.size > 0 and times_us.dtype == np.uint64


class _Orders:
    """Places in the log by time: topics are stored apart, so time is their only order."""

    def __init__(self, topics: list[tuple[str, Columns]]) -> None:
        times = [data["timestamp"] for _, data in topics]
        self.times_us = np.unique(np.concatenate([np.zeros(0, np.uint64), *times]))
        size = self.times_us.size
        self.ticks = Ticks(np.arange(size, dtype=np.int64), np.full(size, np.nan), self.times_us / 1e6)

    def of(self, times_us: NDArray[np.uint64] | np.uint64) -> NDArray[np.int64]:
        return np.asarray(np.searchsorted(self.times_us, times_us), dtype=np.int64)


class _EndlessError(Exception):
    """A damaged file is read over and over."""


class _Bounded(io.BytesIO):
    """A file that can be read a limited number of times: pyulog steps back in damaged ones, some of them for ever."""

    def __init__(self, contents: bytes) -> None:
        super().__init__(contents)
        self._left = _TIMES * len(contents) + _SPARE

    def read(self, size: int | None = -1, /) -> bytes:
        data = super().read(size)
        self._left -= len(data) + 1
        if self._left < 0:
            raise _EndlessError
        return data


def _parsed(contents: bytes) -> Any:  # noqa: ANN401 - pyulog has no types
    from pyulog import ULog
    from pyulog.core import ULogException

    try:
        # It prints what it thinks of damage.
        with contextlib.redirect_stdout(io.StringIO()):
            return ULog(_Bounded(contents), list(TOPICS))
    except (
        _EndlessError,
        ULogException,
        struct.error,
        ValueError,
        KeyError,
        IndexError,
        TypeError,
        AttributeError,
    ) as error:
        raise LogError(
            f"it is a PX4 log that cannot be read ({error or type(error).__name__}); give a whole one"
        ) from error


def _add_positions(recording: Recording, topics: dict[str, Columns], order: _Orders) -> None:
    estimate = topics.get("vehicle_global_position")
    home_m = _home_altitude_m(topics)
    if estimate is not None and {"lat", "lon", "alt"} <= set(estimate):
        places = Places(estimate["lon"], estimate["lat"], estimate["alt"].astype(np.float64), estimate["alt"] - home_m)
        recording.fixes[_SYSTEM, "vehicle_global_position"] = _fixes(estimate, places, order)
    for name in ("vehicle_gps_position", "sensor_gps"):
        gps = topics.get(name)
        degrees, scaled = ({"longitude_deg", "latitude_deg", "altitude_msl_m"}, {"lon", "lat", "alt"})
        if gps is None or "fix_type" not in gps or not (degrees <= set(gps) or scaled <= set(gps)):
            continue
        if degrees <= set(gps):
            lon, lat, alt = gps["longitude_deg"], gps["latitude_deg"], gps["altitude_msl_m"]
        else:
            lon, lat, alt = gps["lon"] / 1e7, gps["lat"] / 1e7, gps["alt"] / 1e3
        places = Places(lon, lat, np.asarray(alt, np.float64), np.asarray(alt - home_m, np.float64))
        recording.fixes[_SYSTEM, name] = _fixes(gps, places, order, gps["fix_type"] >= _FIX_3D)
        if "time_utc_usec" in gps:
            valid = gps["time_utc_usec"] > 0
            offset_s = gps["time_utc_usec"] / 1e6 - gps["timestamp"] / 1e6
            recording.unix[_SYSTEM] = UnixTimes(order.of(gps["timestamp"])[valid], offset_s[valid])
        return


def _fixes(data: Columns, places: Places, order: _Orders, has_fix: NDArray[np.bool_] | None = None) -> Fixes:
    times_us = data["timestamp"]
    everywhere = np.ones(times_us.size, dtype=np.bool_)
    fix = everywhere if has_fix is None else np.asarray(has_fix)
    return Fixes(order.of(times_us), np.full(times_us.size, np.nan), times_us / 1e6, places, fix)


def _home_altitude_m(topics: dict[str, Columns]) -> float:
    home = topics.get("home_position")
    return float(home["alt"][-1]) if home is not None and "alt" in home else float("nan")


def _named(topics: dict[str, Columns], order: _Orders) -> Iterator[NamedValues]:
    if "debug_key_value" in topics:
        # As PX4 sends it: the same series here and in the ground station's log, which has whole milliseconds.
        data = topics["debug_key_value"] | {"timestamp": topics["debug_key_value"]["timestamp"] // 1000 * 1000}
        yield from _by_name("NAMED_VALUE_FLOAT", data, "key", {"": "value"}, order)
    if "debug_vect" in topics:
        axes = {f".{axis}": axis for axis in "xyz"}
        yield from _by_name("debug_vect", topics["debug_vect"], "name", axes, order)
    if "debug_array" in topics:
        data = topics["debug_array"]
        columns = [name for name in data if name.startswith("data[") and bool((data[name] != 0).any())]
        yield from _by_name("debug_array", data, "name", {name[len("data") :]: name for name in columns}, order)


def _by_name(message: str, data: Columns, label: str, columns: dict[str, str], order: _Orders) -> Iterator[NamedValues]:
    """Yield the series of a topic whose names are texts; pyulog gives those one column a letter."""
    letters = [data[f"{label}[{place}]"] for place in range(len(data)) if f"{label}[{place}]" in data]
    if not letters:
        return
    codes = np.ascontiguousarray(np.stack(letters, axis=1).astype(np.uint8))
    named = sorted(rows_by_text(codes.view(f"S{len(letters)}")[:, 0]), key=lambda pair: pair[0])
    for name, rows in named:
        for ending, column in ((ending, column) for ending, column in columns.items() if column in data):
            yield _values(message, f"{name}{ending}", data, data[column], order).take(rows)


def _air(topics: dict[str, Columns], order: _Orders) -> Iterator[NamedValues]:
    air = topics.get("vehicle_air_data", {})
    if "baro_pressure_pa" in air:
        yield _values(AMBIENT, "press_abs", air, air["baro_pressure_pa"] / 100.0, order)
    for name in ("ambient_temperature", "baro_temp_celcius"):  # the second is PX4's own spelling
        if name in air:
            yield _values(AMBIENT, "temperature", air, air[name], order)
            return


def _values(message: str, name: str, data: Columns, values: np.ndarray, order: _Orders) -> NamedValues:
    times_us = data["timestamp"]
    nothing = np.full(times_us.size, np.nan)
    sender = Sender(_SYSTEM, AUTOPILOT)
    value = np.asarray(values, dtype=np.float64)
    return NamedValues(sender, message, name, order.of(times_us), nothing, times_us / 1e6, value)


def _happenings(topics: dict[str, Columns], order: _Orders) -> Iterator[Happening]:
    status = topics.get("vehicle_status", {})
    if "arming_state" in status:
        armed = status["arming_state"] == _ARMED
        for row in changes(armed)[int(not armed[0]) :]:
            yield _happening(status, row, "armed" if armed[row] else "disarmed", order)
    if "nav_state" in status:
        for row in changes(status["nav_state"]):
            yield _happening(status, row, "mode", order, int(status["nav_state"][row]))
    land = topics.get("vehicle_land_detected", {})
    if "landed" in land:
        for row in changes(land["landed"]):
            yield _happening(land, row, "landed_state", order, _ON_GROUND if land["landed"][row] else _IN_AIR)
    mission = topics.get("mission_result", {})
    for name, kind in (("seq_current", "item_current"), ("seq_reached", "item_reached")):
        if name in mission:
            for row in changes(mission[name]):
                if mission[name][row] >= 0:
                    yield _happening(mission, row, kind, order, int(mission[name][row]))


def _happening(data: Columns, row: int, kind: str, order: _Orders, value: int = 0) -> Happening:
    return Happening(int(order.of(data["timestamp"][row])), float("nan"), _SYSTEM, kind, value)


def _texts(file: Any, order: _Orders) -> Iterator[Happening]:  # noqa: ANN401
    for one in file.logged_messages:
        place = int(order.of(np.uint64(one.timestamp)))
        severity = one.log_level - ord("0")
        severity = severity if 0 <= severity <= 7 else _INFO
        yield Happening(place, float("nan"), _SYSTEM, "text", severity, one.message)
