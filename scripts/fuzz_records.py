"""What stands in a log, by slow readers that share no code with the package's: fuzz_logs.py judges by them.

Every reader gives records, each with its place, its length and the values that it holds. Where a format has no checksum
nothing tells damage from data, so what can be held is: a value that is read stands somewhere in the bytes, in a record
that decodes at that place; and a record that was not touched, between neighbours that still lead to it, is read.
"""

from __future__ import annotations

import math
import struct
from collections import Counter
from dataclasses import dataclass, field

from pymavlink.dialects.v20 import ardupilotmega

from sparsor.core.mavlink_frames import LONGEST, FrameReader  # tests hold it against pymavlink

HEAD = b"\xa3\x95"
FMT = 128
PLACES = {"Lat", "Lng", "Alt"}
TIMES = {"TimeUS", "TimeMS", "TimeBootMS"}
OWN_PLACES = frozenset(
    (
        *("ADSB", "AHR2", "AIS1", "AIS4", "AIS5", "BCN", "CAM", "CMD", "FNCE", "FOLL", "GPS", "GPS2", "GPSB", "LAND"),
        *("MISE", "OABR", "OADJ", "ORGN", "POS", "RALY", "SIM", "TERR", "TRIG"),
    )
)
LETTERS = "abBhHiIfdnNZcCeELMqQ"
CODES = dict(zip(LETTERS, ("64s", *"bBhHiIfd", "4s", "16s", "64s", *"hHiIiBqQ"), strict=True))
SCALES = {"c": 0.01, "C": 0.01, "e": 0.01, "E": 0.01, "L": 1e-7}
TEXTS = "anNZ"
ULOG_SIZES = {
    f"{sign}int{8 * size}_t": code
    for sign, codes in (("", "bhiq"), ("u", "BHIQ"))
    for size, code in zip((1, 2, 4, 8), codes, strict=True)
}
ULOG_SIZES |= {"float": "f", "double": "d", "bool": "B", "char": "B"}


@dataclass(frozen=True)
class Record:
    """A piece of a log and the values in it; `needs` is the record that describes it."""

    at: int
    length: int
    values: Counter = field(default_factory=Counter)
    needs: int | None = None
    guard: int = 0  # bytes behind it by which it is known to end there


def tlog_records(data: bytes) -> list[Record]:
    """Return every frame with a right checksum that begins anywhere."""
    found = []
    for at in (place for place, byte in enumerate(data) if byte in (0xFD, 0xFE)):
        for frame in FrameReader().feed(data[at : at + LONGEST])[:1]:
            if not data.startswith(frame.raw, at):
                continue  # it begins farther on
            message = ardupilotmega.MAVLink(None).decode(bytearray(frame.raw))
            values = Counter()
            if message.get_type() == "NAMED_VALUE_FLOAT" and message.value == message.value:
                sender = (frame.system_id, frame.component_id)
                values[sender, message.time_boot_ms, message.name.strip(), message.value] += 1
            found.append(Record(at, len(frame.raw), values))
    return found


def bin_records(data: bytes) -> list[Record]:
    """Return what decodes at any place where the two bytes of a head stand, by any FMT that decodes at any place."""
    heads = [at for at in range(len(data) - 2) if data[at : at + 2] == HEAD]
    formats: dict[int, dict[tuple, int]] = {}
    found = []
    for at in (at for at in heads if data[at + 2] == FMT and at + 89 <= len(data)):
        number, length, name, letters, columns = struct.unpack("<BB4s16s64s", data[at + 3 : at + 89])
        texts = (text.partition(b"\0")[0].decode("ascii", "replace") for text in (name, letters, columns))
        formats.setdefault(number, {}).setdefault((length, *texts), at)
        found.append(Record(at, 89, guard=2))
    for at in (at for at in heads if data[at + 2] != FMT):
        for (length, name, letters, columns), needs in formats.get(data[at + 2], {}).items():
            if at + length <= len(data):
                values = bin_values(name, letters, columns.split(","), data[at + 3 : at + length])
                if values is not None:
                    found.append(Record(at, length, values, needs, guard=2))
    return found


def bin_values(name: str, letters: str, columns: list[str], body: bytes) -> Counter | None:
    """Return the values of one message, or None when its description is not consistent."""
    if not all(one in CODES for one in letters) or len(letters) != len(columns):
        return None
    layout = "<" + "".join(CODES[one] for one in letters)
    if struct.calcsize(layout) != len(body):
        return None
    rows = dict(zip(columns, zip(letters, struct.unpack(layout, body), strict=True), strict=True))
    if name in ("NVAL", "NVF") and {"Name", "Value"} <= set(rows):
        text = rows["Name"][1]
        text = text.partition(b"\0")[0].decode("utf-8", "replace").strip() if isinstance(text, bytes) else ""
        return finite({(text, rows["Value"][1])})
    if name in OWN_PLACES or not {"Lat", "Lng"} <= set(rows):
        return Counter()
    numbers = {key: row for key, row in rows.items() if row[0] not in TEXTS and key not in PLACES | TIMES}
    return finite({(f"{name}.{key}", value * SCALES.get(letter, 1.0)) for key, (letter, value) in numbers.items()})


def finite(values: set) -> Counter:
    return Counter(one for one in values if not isinstance(one[1], bytes) and math.isfinite(one[1]))


def ulog_records(data: bytes) -> list[Record]:
    """Return every message of data that decodes anywhere, with the values of the topic debug_key_value."""
    found = []
    for topic, (name, codes, fields) in ulog_topics(data).items():
        size = struct.calcsize(codes)
        head = struct.pack("<HcH", size + 2, b"D", topic)
        at = data.find(head)
        while at >= 0:
            if at + 5 + size <= len(data):
                row = dict(zip(fields, struct.unpack(codes, data[at + 5 : at + 5 + size]), strict=True))
                values = Counter()
                if name == "debug_key_value":
                    text = row["key"].partition(b"\0")[0].decode("utf-8", "replace").strip()
                    values = finite({(text, row["value"])})
                found.append(Record(at, size + 5, values, guard=5))
            at = data.find(head, at + 1)
    return found


def ulog_topics(data: bytes) -> dict[int, tuple[str, str, list[str]]]:
    """Return the topics that are described before the first message of data: their names, codes and fields."""
    at, formats, topics = 16, {}, {}
    while at + 3 <= len(data) and data[at + 2 : at + 3] != b"D":
        size, kind = struct.unpack("<Hc", data[at : at + 3])
        body = data[at + 3 : at + 3 + size]
        if kind == b"F":
            name, _, fields = body.decode("utf-8", "replace").partition(":")
            formats[name] = ulog_layout([one.split(" ") for one in fields.split(";") if " " in one])
        if kind == b"A" and body[3:].decode("utf-8", "replace") in formats:
            name = body[3:].decode()
            topics[int.from_bytes(body[1:3], "little")] = (name, *formats[name])
        at += 3 + size
    return topics


def ulog_layout(fields: list[list[str]]):
    while fields[-1][1].startswith("_padding"):  # at the end it is not logged
        fields.pop()
    codes, names = "<", []
    for kind, name in fields:
        base, _, size = kind.rstrip("]").partition("[")
        codes += f"{size}s" if base == "char" else ULOG_SIZES.get(base, "") * int(size or 1)
        names += [name] if base == "char" or not size else [f"{name}[{place}]" for place in range(int(size))]
    return codes, names


def table_records(data: bytes) -> list[Record]:
    """Return the rows, each with the number in its last column, which is the value in the tables that are made here."""
    found, at = [], data.find(b"\n") + 1
    for line in data[at:].split(b"\n")[:-1]:
        found.append(Record(at, len(line) + 1, Counter(list(cells(line))[-1:])))
        at += len(line) + 1
    return found


def cells(data: bytes):
    """Yield the numbers in a table, with and without the quotes that a reader of tables takes away."""
    text = data.decode("utf-8", "replace").replace("\0", "")
    for changed in (text.replace('"', ""), *([text.replace('"', ",")] if '"' in text else [])):
        for line in changed.split("\n"):
            yield from numbers(line.split(","))


def numbers(row: list[str]):
    for cell in row:
        try:
            value = float(cell)
        except ValueError:
            continue
        if math.isfinite(value):
            yield value


def values_anywhere(kind: str, data: bytes) -> set:
    """Return every value that stands anywhere in the bytes, read from any place."""
    if kind == "CSV":
        return set(cells(data[data.find(b"\n") + 1 :]))
    return {value for record in READERS[kind](data) for value in record.values}


def short_bin(data: bytes, most: int) -> bytes:
    """Return a .BIN with its descriptions first, and its values, and of the other messages what there is room for."""
    ordered, end = [], 0
    for record in sorted(bin_records(data), key=lambda one: one.at):
        if record.at >= end:
            ordered.append(record)
            end = record.at + record.length
    described = [one for one in ordered if data[one.at + 2] == FMT]
    room = most - sum(one.length for one in described)
    kept = []
    others = [one for one in ordered if data[one.at + 2] != FMT]
    every = max(1, sum(one.length for one in others) // max(room, 1))
    for number, one in enumerate(others):
        if one.values or number % (every + 1) == 0:
            kept.append(one)
    return b"".join(data[one.at : one.at + one.length] for one in (*described, *kept))


READERS = {"tlog": tlog_records, "BIN": bin_records, "ulg": ulog_records, "CSV": table_records}
