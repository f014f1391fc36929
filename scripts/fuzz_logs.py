#!/usr/bin/env python3
"""Damage flight logs at random and read them: never a crash, never a hang, never a value that was not there.

    scripts/fuzz_logs.py [LOG...] [--runs 2000] [--seed 0] [--atheris SECONDS]

Without a log it makes one of each kind, from flights of the practice autopilots. Cuts, flips, insertions, exchanged
pieces, and pieces in another order; in two runs of three the definitions at a file's beginning are spared. Judged by
slow readers of its own (fuzz_records.py). In a .tlog

  - every (source, boot time, name, value) that is read is in the whole log,
  - every value is read whose frame was not touched,

but for frames of chance whose checksum is right (one false beginning in 65 536): those are collisions, counted apart.
The other kinds have no checksum: damage inside a record cannot be told from data. Where the definitions are whole

  - .BIN, .ulg: every value that is read decodes from a message that stands in the bytes; every value is read whose
    message was not touched and leads to the next one. "Collisions" are damaged bytes that pass for a message, the
    length of which led beyond such a one.
  - CSV: every value that is read stands in a cell; every row is read that was not touched.

With --atheris the reading is then driven by coverage, each log in turn, where the package `atheris` is installed
(fuzz_coverage.py). Exit 1 when there is a fault.
"""

from __future__ import annotations

import argparse
import math
import random
import re
import subprocess
import sys
import tempfile
import time
from collections import Counter
from contextlib import suppress
from importlib.util import find_spec
from itertools import pairwise
from pathlib import Path

import numpy as np

import fuzz_records
from sparsor.core.mavlink_scan import STAMP
from sparsor.errors import LogError
from sparsor.flightlog import AMBIENT, read_log, samples, ulog
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
MOST_BIN_BYTES = 6_000_000
SEED_BYTES = 3000
SHUFFLED = 0.2  # of the runs
MAGIC_2 = b"\xfd"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("logs", nargs="*", type=Path)
    parser.add_argument("--runs", type=int, default=2000, help="for each log")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--atheris", type=int, metavar="SECONDS", help="then go on by coverage, so long on each log")
    parser.add_argument("--pyulog-alone", action="store_true", help="read damaged .ulg files without mending them")
    options = parser.parse_args()
    if options.pyulog_alone:
        ulog.mended = lambda contents: (contents, 0, 0)
    with tempfile.TemporaryDirectory() as folder:
        logs = options.logs or made_logs(Path(folder))
        faults = sum(damaged_runs(path, options.runs, options.seed) for path in logs)
        if options.atheris:
            faults += sum(by_coverage(path, options.atheris) for path in logs)
    return 1 if faults else 0


def made_logs(folder: Path) -> list[Path]:
    copter, px4 = (recorded_flight(autopilot, folder / autopilot) for autopilot in ("ardupilot", "px4"))
    tlog, table = folder / "flight.tlog", folder / "samples.csv"
    tlog.write_bytes(copter.tlog)
    found = samples(read_log(tlog), sensor="NO2")
    columns = (found.time_s, found.lon_deg, found.lat_deg, found.alt_m, found.value)
    rows = [",".join(map(repr, row)) for row in zip(*(column.tolist() for column in columns), strict=True)]
    table.write_text("\n".join(["time_s,lon_deg,lat_deg,alt_m,value", *rows, ""]), encoding="utf-8")
    return [tlog, copter.vehicle_log, px4.vehicle_log, table]


def damaged_runs(path: Path, runs: int, seed: int) -> int:
    kind, whole = short_log(path)
    records = fuzz_records.READERS[kind](whole)
    known = Counter(value for record in records for value in record.values.elements())
    judge_whole(path, values_in(kind, whole), known)
    spared = beginning(kind, whole)
    draw = random.Random(seed)
    counts: Counter[str] = Counter()
    slowest_s = 0.0
    for run in range(runs):
        spare = spared if run % 3 else 0
        data, origin = damaged(whole, draw, spare)
        start = time.perf_counter()
        found = values_in(kind, data)
        slowest_s = max(slowest_s, time.perf_counter() - start)
        counts["refused"] += found is None
        if found is not None and (spare or kind == "tlog"):
            traces = Traces(origin, len(whole))
            places = ((traces.place(record, data, kind), record) for record in records if record.values)
            there = {at: record for at, record in places if at >= 0}
            judged = judge(kind, data, traces, found, known, there)
            counts[judged] += 1
            expected = sum((record.values for record in there.values()), Counter())
            counts["expected"] += expected.total()
            counts["missing"] += (expected - found).total()
            if judged == "faults":
                Path(f"fault-{path.name}-{run}").write_bytes(data)
    counts["faults"] += slowest_s > SLOW_S
    share = 100 * (1 - counts["missing"] / max(counts["expected"], 1))
    print(
        f"{path.name}: {kind}, {len(whole) / 1e3:.0f} kB, {known.total()} values, {runs} damages, "
        f"{counts['refused']} refused with a LogError, slowest {slowest_s:.2f} s, "
        f"{counts['expected']} untouched values, {share:.4f} % of them read, "
        f"{counts['collisions']} runs with collisions, {counts['faults']} faults",
        flush=True,
    )
    return counts["faults"]


def short_log(path: Path) -> tuple[str, bytes]:
    kind = read_log(path).kinds[0]
    whole = LogFile(path).contents()
    if kind == "BIN" and len(whole) > MOST_BYTES:
        return kind, fuzz_records.short_bin(whole[:MOST_BIN_BYTES], MOST_BYTES)
    return kind, whole[:MOST_BYTES]


def beginning(kind: str, whole: bytes) -> int:
    """Return how many bytes the definitions are; a .tlog has none."""
    if kind == "CSV":
        return whole.find(b"\n") + 1
    if kind == "BIN":
        return whole.rfind(b"\xa3\x95\x80") + 89 + 2  # and the next head, without which the last one is not believed
    return ulog_beginning(whole) if kind == "ulg" else 0


def ulog_beginning(whole: bytes) -> int:
    at = 16
    while whole[at + 2 : at + 3] != b"D":
        at += 3 + int.from_bytes(whole[at : at + 2], "little")
    return at + 5  # with the next head, without which the last definition is not believed


def judge_whole(path: Path, found: Counter | None, known: Counter) -> None:
    if found is None or found != known:
        differ = None if found is None else [*(found - known).items(), *(known - found).items()][:5]
        sys.exit(f"{path}: fuzz_records.py reads the undamaged log otherwise: {differ}")


def judge(kind, data, traces, found, known, there) -> str:
    """Return whether what was read is "right", explained by "collisions", or not: "faults"."""
    expected = sum((record.values for record in there.values()), Counter())
    missing = expected - found
    invented = set(found - known)
    if kind != "tlog" and invented:  # what the whole log lacks may stand there now
        invented -= fuzz_records.values_anywhere(kind, data)
    if not invented and not missing:
        return "right"
    if kind == "CSV":
        return "faults"
    touched = [one for one in fuzz_records.READERS[kind](data) if not traces.whole(one.at, one.length)]
    if invented and not (kind == "tlog" and invented <= {value for one in touched for value in one.values}):
        return "faults"
    hidden = {
        value
        for at, record in there.items()
        if any(one.at < at < one.at + one.length for one in touched)
        for value in record.values
    }
    return "collisions" if set(missing) <= hidden else "faults"


class Traces:
    """Where the bytes of the whole log are in the damaged one."""

    def __init__(self, origin: np.ndarray, size: int) -> None:
        self.places = np.full(size + 1, -1)
        kept = np.flatnonzero(origin >= 0)
        self.places[origin[kept]] = kept
        joints = np.concatenate(([0], (np.diff(origin) != 1) | (origin[1:] < 0)))
        self.breaks = np.append(np.cumsum(joints), -1)
        self.origin = origin

    def whole(self, at: int, length: int) -> bool:
        """Return whether a piece of the damaged log stood like this in the whole one."""
        return self.origin[at] >= 0 and self.breaks[at] == self.breaks[min(at + length, self.breaks.size) - 1]

    def place(self, record, data: bytes, kind: str) -> int:
        """Return where a record is if nothing of it, nor of what tells its end, was touched; else -1."""
        at, length = int(self.places[record.at]), record.length + record.guard
        if at < 0 or at + length > len(data) or not self.whole(at, length):
            return -1
        return at if kind != "CSV" or data[at - 1 : at] == b"\n" else -1


def values_in(kind: str, data: bytes) -> Counter | None:
    """Return every value with what tells it from others in its kind, or None when the log was refused in words."""
    try:
        log = assemble("damaged", READERS[kind](data))
    except LogError:
        return None
    found: Counter = Counter()
    for values in log.values:
        if values.message == AMBIENT or (kind == "tlog" and values.message != "NAMED_VALUE_FLOAT"):
            continue
        stamps = (values.stamp_s * 1e3).round() if kind == "tlog" else values.stamp_s
        for stamp_ms, value in zip(stamps.tolist(), values.value.tolist(), strict=True):
            if math.isfinite(value) or kind == "tlog":
                key = {"tlog": (values.sender, stamp_ms, values.name, value), "CSV": value}
                found[key.get(kind, (values.name, value))] += value == value
    with suppress(LogError):
        samples(log)
    return found


def damaged(whole: bytes, draw: random.Random, spare: int) -> tuple[bytes, np.ndarray]:
    """Return a damaged log, and for each byte where it was before, -1 if it is new or another; `spare` stay first."""
    data = np.frombuffer(whole, dtype=np.uint8)[spare:]
    origin = np.arange(spare, len(whole))
    if draw.random() < SHUFFLED:
        rows = shuffled(whole, draw, spare)
        data, origin = data[rows], origin[rows]
    for _ in range(draw.randint(1, 30)):
        at = draw.randrange(max(data.size, 1))
        how = draw.randrange(4)
        size = draw.randint(1, 500)
        if how == 0:
            data, origin = (np.delete(row, slice(at, at + size)) for row in (data, origin))
        elif how == 1 and data.size:
            data, origin = data.copy(), origin.copy()
            data[at] ^= 1 << draw.randrange(8)
            origin[at] = -1
        elif how == 2:
            data = np.insert(data, at, np.frombuffer(draw.randbytes(size), dtype=np.uint8))
            origin = np.insert(origin, at, np.full(size, -1))
        else:
            to, size = draw.randrange(max(data.size, 1)), draw.randint(1, 2000)
            first, second = sorted((at, to))
            edges = [0, first, min(first + size, second), second, min(second + size, data.size), data.size]
            parts = [slice(a, b) for a, b in pairwise(edges)]
            data, origin = (np.concatenate([row[parts[k]] for k in (0, 3, 2, 1, 4)]) for row in (data, origin))
    return whole[:spare] + data.tobytes(), np.concatenate((np.arange(spare), origin))


def shuffled(whole: bytes, draw: random.Random, spare: int) -> np.ndarray:
    """Return the bytes' new order: pieces of some hundred bytes; most of a .tlog's are whole records."""
    size = draw.randint(20, 2000)
    ends = range(spare, len(whole), size)
    starts = [
        max(whole.rfind(MAGIC_2, spare, end) - STAMP, spare) for end in ends[1:]
    ]  # a record begins before its frame
    edges = sorted({spare, *starts, len(whole)})
    pieces = [np.arange(start - spare, end - spare) for start, end in pairwise(edges)]
    draw.shuffle(pieces)
    return np.concatenate(pieces)


def by_coverage(path: Path, seconds: int) -> int:
    """Let `fuzz_coverage.py` change a small piece of a log; return whether it found a fault."""
    if find_spec("atheris") is None:
        sys.exit("atheris is not installed: pip install atheris (Linux, CPython 3.11 to 3.13)")
    kind, whole = short_log(path)
    with tempfile.TemporaryDirectory() as folder:
        begin = beginning(kind, whole) % SEED_BYTES  # most of what defines the rest, and some of it
        for number, size in enumerate((300, 2000, begin + SEED_BYTES)):
            (Path(folder) / f"{number}.{kind}").write_bytes(whole[:size])
        script = Path(__file__).with_name("fuzz_coverage.py")
        ended = subprocess.run(
            [sys.executable, str(script), kind, folder, str(seconds)], capture_output=True, text=True, check=False
        )
    stats = dict(re.findall(r"stat::(\w+):\s*(\d+)", ended.stderr))
    tried = stats.get("number_of_executed_units", "no")
    print(
        f"{path.name}: {kind}, by coverage {tried} inputs in {seconds} s, ",
        end="",
    )
    print("no fault" if ended.returncode == 0 else f"a fault (its input is in this folder):\n{ended.stderr[-3000:]}")
    return int(ended.returncode != 0)


if __name__ == "__main__":
    sys.exit(main())
