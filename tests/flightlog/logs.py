"""Flight logs of every kind, written by the tests themselves: whole ones, to be read back or damaged."""

from __future__ import annotations

import struct
from dataclasses import dataclass, field
from typing import Any

from pymavlink.dialects.v10 import ardupilotmega as v1
from pymavlink.dialects.v20 import ardupilotmega as v2

HOME = (51.5, 25.3, 10.0)
START_US = 1_700_000_000_000_000
BOOT_UNIX_S = 1_699_999_990.0


@dataclass
class TlogMaker:
    """Collects records; every message is stamped by the recorder's clock and packed by pymavlink."""

    records: list[bytes] = field(default_factory=list)
    sequences: dict[tuple[int, int], int] = field(default_factory=dict)
    dialect: Any = v2
    key: bytes | None = None

    def add(self, message: Any, received_s: float, system: int = 1, component: int = 1) -> None:
        sender = self.dialect.MAVLink(None, system, component)
        sender.seq = self.sequences.get((system, component), 0)
        self.sequences[system, component] = (sender.seq + 1) % 256
        if self.key is not None:
            sender.signing.secret_key, sender.signing.timestamp, sender.signing.sign_outgoing = self.key, 1, True
        self.records.append(struct.pack(">Q", START_US + round(received_s * 1e6)) + message.pack(sender))

    def position(self, boot_s: float, received_s: float, lon: float, lat: float, up: float = 30.0, **who: int) -> None:
        message = self.dialect.MAVLink_global_position_int_message(
            round(boot_s * 1e3),
            round(lat * 1e7),
            round(lon * 1e7),
            round((HOME[2] + up) * 1e3),
            round(up * 1e3),
            0,
            0,
            0,
            0,
        )
        self.add(message, received_s, **who)

    def gps(self, boot_s: float, received_s: float, lon: float, lat: float, fix: int = 3) -> None:
        message = self.dialect.MAVLink_gps_raw_int_message(
            round(boot_s * 1e6), fix, round(lat * 1e7), round(lon * 1e7), 40_000, 80, 120, 0, 0, 12
        )
        self.add(message, received_s)

    def named(self, stamp_ms: int, received_s: float, value: float, name: bytes = b"NO2", **who: int) -> None:
        self.add(self.dialect.MAVLink_named_value_float_message(stamp_ms, name, value), received_s, **who)

    def time(self, boot_s: float, received_s: float) -> None:
        unix_us = round((BOOT_UNIX_S + boot_s) * 1e6)
        self.add(self.dialect.MAVLink_system_time_message(unix_us, round(boot_s * 1e3)), received_s)

    @property
    def content(self) -> bytes:
        return b"".join(self.records)


def place(boot_s: float) -> tuple[float, float]:
    """The straight flight all made-up logs hold: east at about 5 m/s."""
    return HOME[0] + 5e-5 * boot_s, HOME[1]


def value_at(lon: float) -> float:
    """What the made-up sensor shows: linear in longitude, so that interpolation is exact."""
    return (lon - HOME[0]) * 1e4


def flight(
    seconds: int = 60, *, rate: float = 1.0, dialect: Any = v2, start_s: float = 10.0, maker: Any = None
) -> TlogMaker:
    """A flight of positions four times a second and samples once a second, received at `rate` times real time."""
    made = maker or TlogMaker(dialect=dialect)
    for quarter in range(4 * seconds + 1):
        boot_s = start_s + quarter / 4
        received_s = boot_s / rate
        made.position(boot_s, received_s, *place(boot_s))
        if quarter % 4 == 2:
            made.time(boot_s + 0.01, received_s + 0.01 / rate)
            made.named(round(boot_s * 1e3) + 100, received_s + 0.1 / rate, value_at(place(boot_s + 0.1)[0]))
    return made


FORMATS = (
    (1, "POS", "QLLff", "TimeUS,Lat,Lng,Alt,RelHomeAlt"),
    (2, "NO2S", "QLLff", "TimeUS,Lat,Lng,Alt,NO2"),
    (3, "NVAL", "QINfBB", "TimeUS,TimeBootMS,Name,Value,SSys,SCom"),
    (4, "ARM", "QB", "TimeUS,ArmState"),
    (5, "TEMP", "Qh", "TimeUS,T"),
)
_CODES = {"Q": "Q", "L": "i", "f": "f", "I": "I", "N": "16s", "B": "B", "h": "h"}


def bin_message(number: int, *values: Any) -> bytes:
    letters = next(one[2] for one in FORMATS if one[0] == number)
    return b"\xa3\x95" + bytes([number]) + struct.pack("<" + "".join(_CODES[one] for one in letters), *values)


def bin_flight(seconds: int = 60) -> bytes:
    """The same flight as ArduPilot would log it, with a script's own message and a companion's named value."""
    out = b""
    for number, name, letters, columns in ((128, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns"), *FORMATS):
        length = 89 if number == 128 else 3 + struct.calcsize("<" + "".join(_CODES[one] for one in letters))
        texts = (text.encode() for text in (name, letters, columns))
        out += b"\xa3\x95\x80" + struct.pack("<BB4s16s64s", number, length, *texts)
    out += bin_message(4, 10_000_000, 1)
    for quarter in range(4 * seconds + 1):
        us = 10_000_000 + quarter * 250_000
        lon, lat = (round(degrees * 1e7) for degrees in place(us / 1e6))
        out += bin_message(1, us, lat, lon, 40.0, 30.0)
        if quarter % 4 == 2:
            value = value_at(lon / 1e7)
            out += bin_message(2, us, lat, lon, 40.0, value)
            out += bin_message(3, us, us // 10_000, b"NO2C", value, 1, 191)
            out += bin_message(5, us, 21)
    return out


def ulog_flight(seconds: int = 60) -> bytes:
    """The same flight as PX4 would log it."""
    formats = {
        0: ("vehicle_global_position", "uint64_t timestamp;double lat;double lon;float alt;"),
        1: ("debug_key_value", "uint64_t timestamp;float value;char[10] key;"),
        2: ("vehicle_land_detected", "uint64_t timestamp;bool landed;"),
        3: ("debug_vect", "uint64_t timestamp;float x;float y;float z;char[10] name;"),
    }

    def message(kind: bytes, body: bytes) -> bytes:
        return struct.pack("<Hc", len(body), kind) + body

    def data(topic: int, layout: str, *values: Any) -> bytes:
        return message(b"D", struct.pack("<H" + layout, topic, *values))

    out = b"ULog\x01\x12\x35\x01" + struct.pack("<Q", 10_000_000) + message(b"B", bytes(40))
    out += b"".join(message(b"F", f"{name}:{fields}".encode()) for name, fields in formats.values())
    out += b"".join(message(b"A", struct.pack("<BH", 0, topic) + formats[topic][0].encode()) for topic in formats)
    out += message(b"L", b"6" + struct.pack("<Q", 10_500_000) + b"take-off")
    out += data(2, "QB", 10_000_000, 1) + data(2, "QB", 12_000_000, 0)
    for quarter in range(4 * seconds + 1):
        us = 10_000_000 + quarter * 250_000
        lon, lat = place(us / 1e6)
        out += data(0, "Qddf", us, lat, lon, 40.0)
        if quarter % 4 == 2:
            out += data(1, "Qf10s", us, value_at(lon), b"NO2")
            out += data(3, "Qfff10s", us, 1.0, 2.0, 3.0, b"wind")
    return out


def table_flight(seconds: int = 60) -> bytes:
    rows = ["time_s,lon_deg,lat_deg,alt_m,value,clock,used"]
    for second in range(seconds):
        boot_s = 10.5 + second
        lon, lat = place(boot_s)
        rows.append(f"{boot_s},{lon:.7f},{lat:.7f},40.0,{value_at(lon)},vehicle,1")
    return "\n".join(rows).encode() + b"\n"


__all__ = ["TlogMaker", "bin_flight", "flight", "place", "table_flight", "ulog_flight", "v1", "v2", "value_at"]
