#!/usr/bin/env python3
"""Damage flight logs at random and read them: never a crash, never a hang, never a value that was not there.

    scripts/fuzz_logs.py [LOG...] [--runs 2000] [--seed 0] [--atheris SECONDS]

Without a log it makes one of each kind, from a flight of the practice autopilot. Cuts, flips, insertions, exchanged
pieces, and records in another order. In a .tlog every (source, boot time, name, value) that the whole log
lacks is counted, and judged by a reader of its own: a false frame whose checksum happens to be right (one in 65 536)
is a collision, anything else is a fault. With --atheris the same reading is driven by coverage, where the package
`atheris` is installed. Exit 1 when there is a fault.
"""

from __future__ import annotations

import argparse
import random
import sys
import tempfile
import time
from itertools import pairwise
from pathlib import Path

from sparsor.core.mavlink_frames import LONGEST as LONGEST_FRAME
from sparsor.core.mavlink_frames import FrameReader
from sparsor.core.mavlink_scan import STAMP
from sparsor.errors import LogError
from sparsor.flightlog import read_log, samples
from sparsor.flightlog.assembly import assemble
from sparsor.flightlog.binlog import read_bin
from sparsor.flightlog.opening import LogFile
from sparsor.flightlog.table import read_table
from sparsor.flightlog.tlog import read_tlog
from sparsor.flightlog.ulog import read_ulog

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))  # the recorded practice flight is the tests'
from flightlog.recorded import recorded_flight

READERS = {
    "tlog": lambda data: read_tlog([data]),
    "BIN": lambda data: read_bin([data]),
    "ulg": read_ulog,
    "CSV": lambda data: read_table([data]),
}
SLOW_S = 30.0
MOST_BYTES = 400_000
SHUFFLED = 0.2  # of the runs
MAGIC_2 = b"\xfd"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("logs", nargs="*", type=Path)
    parser.add_argument("--runs", type=int, default=2000, help="for each log")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--atheris", type=int, metavar="SECONDS", help="then go on by coverage, on the first log")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        logs = options.logs or made_logs(Path(folder))
        faults = sum(damaged_runs(path, options.runs, options.seed) for path in logs)
        if options.atheris:
            by_coverage(logs[0], options.atheris)
    return 1 if faults else 0


def made_logs(folder: Path) -> list[Path]:
    copter, px4 = (recorded_flight(autopilot, folder / autopilot) for autopilot in ("ardupilot", "px4"))
    tlog, table = folder / "flight.tlog", folder / "samples.csv"
    tlog.write_bytes(copter.tlog)
    found = samples(read_log(tlog), sensor="NO2")
    columns = (found.time_s, found.lon_deg, found.lat_deg, found.alt_m, found.value)
    rows = [",".join(map(repr, row)) for row in zip(*(column.tolist() for column in columns), strict=True)]
    table.write_text("\n".join(["time_s,lon_deg,lat_deg,alt_m,value", *rows]), encoding="utf-8")
    return [tlog, copter.vehicle_log, px4.vehicle_log, table]


def damaged_runs(path: Path, runs: int, seed: int) -> int:
    kind = read_log(path).kinds[0]
    whole = LogFile(path).contents()[:MOST_BYTES]
    known = values_in(kind, whole)
    draw = random.Random(seed)
    faults = collisions = refused = 0
    slowest_s = 0.0
    for _ in range(runs):
        data = damaged(whole, draw)
        start = time.perf_counter()
        found = values_in(kind, data)
        slowest_s = max(slowest_s, time.perf_counter() - start)
        refused += found is None
        if kind == "tlog":
            foreign = found - known
            collided = foreign and foreign <= frames_in(data)
            collisions += bool(collided)
            faults += bool(foreign) and not collided
    faults += slowest_s > SLOW_S
    print(
        f"{path.name}: {kind}, {runs} damages, {refused} refused with a LogError, slowest {slowest_s:.2f} s, "
        f"{collisions} with a checksum collision, {faults} faults"
    )
    return faults


def values_in(kind: str, data: bytes):
    """Return every (source, boot time, name, value), or None when the log was refused in words."""
    try:
        log = assemble("damaged", READERS[kind](data))
    except LogError:
        return None
    return {
        (values.sender, round(stamp_s * 1e3), values.name, value)
        for values in log.values
        if values.message == "NAMED_VALUE_FLOAT"
        for stamp_s, value in zip(values.stamp_s.tolist(), values.value.tolist(), strict=True)
        if value == value
    }


def frames_in(data: bytes):
    """Return the same of every right checksum that begins anywhere in the bytes."""
    from pymavlink.dialects.v20 import ardupilotmega

    found = set()
    for at in (place for place, byte in enumerate(data) if byte in (0xFD, 0xFE)):
        for frame in FrameReader().feed(data[at : at + LONGEST_FRAME])[:1]:
            one = ardupilotmega.MAVLink(None).decode(bytearray(frame.raw))
            if one.get_type() == "NAMED_VALUE_FLOAT":
                found.add(((frame.system_id, frame.component_id), one.time_boot_ms, one.name, one.value))
    return found


def damaged(whole: bytes, draw: random.Random) -> bytes:
    data = bytearray(whole)
    if draw.random() < SHUFFLED:
        data = shuffled(whole, draw)
    for _ in range(draw.randint(1, 30)):
        at = draw.randrange(max(len(data), 1))
        how = draw.randrange(4)
        if how == 0:
            del data[at : at + draw.randint(1, 500)]
        elif how == 1 and data:
            data[at] ^= 1 << draw.randrange(8)
        elif how == 2:
            data[at:at] = draw.randbytes(draw.randint(1, 500))
        else:
            to, size = draw.randrange(max(len(data), 1)), draw.randint(1, 2000)
            data[at : at + size], data[to : to + size] = data[to : to + size], data[at : at + size]
    return bytes(data)


def shuffled(whole: bytes, draw: random.Random) -> bytearray:
    """Return the log's pieces, some hundred bytes each, in another order; most of a .tlog's are whole records."""
    size = draw.randint(20, 2000)
    ends = range(0, len(whole), size)
    starts = [max(whole.rfind(MAGIC_2, 0, end) - STAMP, 0) for end in ends[1:]]  # a record begins before its frame
    edges = sorted({0, *starts, len(whole)})
    pieces = [whole[start:end] for start, end in pairwise(edges)]
    draw.shuffle(pieces)
    return bytearray(b"".join(pieces))


def by_coverage(path: Path, seconds: int) -> None:
    try:
        import atheris
    except ImportError:
        sys.exit("atheris is not installed: pip install atheris (Linux, CPython 3.11 to 3.13)")
    kind, seed = read_log(path).kinds[0], LogFile(path).contents()[:20_000]

    def one_input(data: bytes) -> None:
        cut = len(data) * 7 % len(seed)
        values_in(kind, seed[:cut] + data + seed[cut:])

    atheris.instrument_func(one_input)
    atheris.Setup([sys.argv[0], f"-max_total_time={seconds}", "-timeout=30"], one_input)
    atheris.Fuzz()


if __name__ == "__main__":
    sys.exit(main())
