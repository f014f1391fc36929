"""PX4's log, ULog version 1: messages that the log itself describes.

https://docs.px4.io/main/en/dev_log/ulog_file_format.html. The topics have fields of PX4's own messages
(msg/*.msg), those that the practice vehicle can fill, in the order that PX4 stores them: the widest first.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Mapping

MAGIC: Final = b"ULog\x01\x12\x35\x01"  # the last byte is the version
TYPES: Final = {
    "uint64_t": "Q", "int64_t": "q", "double": "d", "uint32_t": "I", "int32_t": "i", "float": "f", "uint16_t": "H",
    "uint8_t": "B", "bool": "?", "char[10]": "10s",
}  # fmt: skip
ALIGNMENT: Final = 8


@dataclass(frozen=True)
class Topic:
    """One kind of message.

    Parameters
    ----------
    number : int
        msg_id in this log.
    name : str
    fields : tuple of (str, str)
        Type and name; the first is the timestamp, microseconds since power-up.
    """

    number: int
    name: str
    fields: tuple[tuple[str, str], ...]

    @cached_property
    def layout(self) -> struct.Struct:
        """The message without the padding at its end, which PX4 describes and does not write."""
        return struct.Struct("<" + "".join(TYPES[kind] for kind, _ in self.fields))

    def description(self) -> bytes:
        """Return the FORMAT message."""
        fields = [f"{kind} {name};" for kind, name in self.fields]
        padding = -self.layout.size % ALIGNMENT
        if padding:
            fields.append(f"uint8_t[{padding}] _padding0;")
        return message("F", f"{self.name}:{''.join(fields)}".encode())

    def subscription(self) -> bytes:
        """Return the ADD_LOGGED message."""
        return message("A", struct.pack("<BH", 0, self.number) + self.name.encode())

    def record(self, values: Mapping[str, float | bytes]) -> bytes:
        """Return a DATA message; fields that are not given are zero."""
        empty = {"char[10]": b""}
        row = [values.get(name, empty.get(kind, 0)) for kind, name in self.fields]
        return message("D", struct.pack("<H", self.number) + self.layout.pack(*row))


def _topic(number: int, name: str, **fields: str) -> Topic:
    """Return a topic whose fields are given by type, separated by blanks."""
    listed = {"uint64_t": "timestamp"} | fields
    return Topic(number, name, tuple((kind, one) for kind, names in listed.items() for one in names.split()))


POSITION: Final = _topic(
    0, "vehicle_global_position",
    uint64_t="timestamp timestamp_sample",
    double="lat lon",
    float="alt alt_ellipsoid delta_alt eph epv terrain_alt",
    uint8_t="lat_lon_reset_counter alt_reset_counter",
    bool="terrain_alt_valid dead_reckoning",
)  # fmt: skip
GPS: Final = _topic(
    1, "vehicle_gps_position",
    uint64_t="timestamp timestamp_sample time_utc_usec",
    double="latitude_deg longitude_deg altitude_msl_m altitude_ellipsoid_m",
    uint32_t="device_id",
    float="s_variance_m_s c_variance_rad eph epv hdop vdop vel_m_s vel_n_m_s vel_e_m_s vel_d_m_s cog_rad",
    int32_t="timestamp_time_relative",
    uint8_t="fix_type satellites_used",
    bool="vel_ned_valid",
)  # fmt: skip
NAMED: Final = Topic(
    2, "debug_key_value", (("uint64_t", "timestamp"), ("float", "value"), ("char[10]", "key"))
)  # fmt: skip
STATUS: Final = _topic(
    3, "vehicle_status",
    uint64_t="timestamp armed_time takeoff_time nav_state_timestamp",
    uint8_t="arming_state nav_state nav_state_user_intention vehicle_type system_type system_id component_id",
    bool="failsafe gcs_connection_lost pre_flight_checks_pass",
)  # fmt: skip
BATTERY: Final = _topic(
    4, "battery_status",
    uint64_t="timestamp",
    float="voltage_v current_a discharged_mah remaining time_remaining_s",
    uint16_t="capacity",
    uint8_t="cell_count id warning",
    bool="connected",
)  # fmt: skip
TOPICS: Final = (POSITION, GPS, NAMED, STATUS, BATTERY)


def message(kind: str, payload: bytes) -> bytes:
    """Return one message of the file.

    Examples
    --------
    >>> message("S", b"ab").hex()
    '0200536162'
    """
    return struct.pack("<HB", len(payload), ord(kind)) + payload


def beginning(time_us: int) -> bytes:
    """Return the file's header and the flags, none of which is set."""
    return MAGIC + struct.pack("<Q", time_us) + message("B", bytes(40))


def info(kind: str, name: str, value: bytes) -> bytes:
    """Return an INFO message."""
    return _keyed("I", f"{kind} {name}", value)


def info_text(name: str, text: str) -> bytes:
    """Return an INFO message with a text."""
    return info(f"char[{len(text.encode())}]", name, text.encode())


def parameter(name: str, value: float, *, whole: bool) -> bytes:
    """Return a PARAMETER message."""
    packed = struct.pack("<i", round(value)) if whole else struct.pack("<f", value)
    return _keyed("P", f"{'int32_t' if whole else 'float'} {name}", packed)


def text_message(level: int, time_us: int, text: str) -> bytes:
    """Return a logged text; its level is MAV_SEVERITY as a digit."""
    return message("L", struct.pack("<BQ", ord(str(level)), time_us) + text.encode())


def _keyed(kind: str, key: str, value: bytes) -> bytes:
    return message(kind, bytes([len(key.encode())]) + key.encode() + value)
