#!/usr/bin/env python3
"""Time our .tlog reader against pymavlink's, side by side in one run, and compare what they find.

    scripts/bench/tlog_speed.py [LOG.tlog ...] [--repeats 5] [--megabytes 100 400]

Without a log it records a flight of the practice autopilot and repeats it, boot after boot, to each size. Both decode
the messages that a map needs and pass over the others; pymavlink through `mavlink_connection`, once, and not on logs of
more than 200 MB, for which it takes minutes. Times are the processor's, so that whatever else runs does not count. The
peak of memory is that of a process of its own, above what an idle one has (Linux); how it and the time grow from log to
log is printed last.
"""

from __future__ import annotations

import argparse
import math
import re
import struct
import sys
import tempfile
import time
from concurrent.futures import ProcessPoolExecutor
from itertools import pairwise
from multiprocessing import get_context
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from pymavlink import mavutil
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from sparsor.core.mavlink_scan import STAMP
from sparsor.flightlog import read_log
from sparsor.flightlog.messages import WANTED, read_messages
from sparsor.flightlog.opening import LogFile

sys.path.insert(0, str(Path(__file__).parents[2] / "tests"))  # the recorded practice flight is the tests'
from flightlog.recorded import recorded_flight

if TYPE_CHECKING:
    from collections.abc import Callable

T = TypeVar("T")
PAUSE_US = 60_000_000
MOST_BYTES = 200_000_000
LEAST_MB = 50  # of shorter logs the fixed costs are nearly all


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("logs", nargs="*", type=Path)
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--megabytes", type=float, nargs="+", default=[100.0, 400.0], help="of the logs that are made")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        logs = options.logs or made_logs(Path(folder), sorted(options.megabytes))
        read_log(logs[0])  # compiled now
        rows = [report(path, options.repeats) for path in logs]
    for (size, seconds, peak), (larger, longer, higher) in pairwise(sorted(row for row in rows if row[0] > LEAST_MB)):
        print(
            f"from {size:.0f} to {larger:.0f} MB: {100 * (higher - peak) / (larger - size):.1f} MB of memory and "
            f"{100 * (longer - seconds) / (larger - size):.2f} s for every 100 MB"
        )


def report(path: Path, repeats: int) -> tuple[float, float, float]:
    """Print what one log takes; return its megabytes, our seconds and our peak of memory, MB."""
    size = path.stat().st_size
    frames_s, ours = least_cpu(lambda: count(path), repeats) if size <= MOST_BYTES else (None, None)
    log_s, _ = least_cpu(lambda: read_log(path), repeats)
    print(f"{path.name}: {size / 1e6:.1f} MB")
    if frames_s is not None:
        pymavlink_s, theirs = least_cpu(lambda: pymavlink_count(path), 1)
        again_s, _ = least_cpu(lambda: read_log(path), repeats)  # the machine may be busier now than it was before
        print(f"  wanted messages      {ours}, by pymavlink {theirs}")
        print(f"  pymavlink            {line(pymavlink_s, size)}")
        print(f"  our messages         {line(frames_s, size)}  {pymavlink_s / frames_s:6.0f} x")
        print(f"  our whole flight log {line(log_s, size)}  {pymavlink_s / log_s:6.0f} x")
        print(f"  the same, afterwards {line(again_s, size)}  {pymavlink_s / again_s:6.0f} x")
    else:
        print(f"  our whole flight log {line(log_s, size)}")
    peak = peak_mb(path)
    print(f"  our peak of memory   {peak:8.0f} MB")
    return size / 1e6, log_s, peak


def least_cpu(action: Callable[[], T], repeats: int) -> tuple[float, T]:
    """Return the fewest seconds of the processor that an action took, and its result."""
    taken_s = []
    for _ in range(repeats):
        start = time.process_time()
        result = action()
        taken_s.append(time.process_time() - start)
    return min(taken_s), result


def line(seconds: float, size: int) -> str:
    return f"{seconds:8.3f} s  {size / seconds / 1e6:8.1f} MB/s"


def count(path: Path) -> int:
    tables, _ = read_messages(LogFile(path).blocks())
    return sum(table.order.size for table in tables.values())


def pymavlink_count(path: Path) -> int:
    log = mavutil.mavlink_connection(str(path), dialect="ardupilotmega")
    names = {mavlink.mavlink_map[number].msgname for number in WANTED}
    found = 0
    while log.recv_match(type=names) is not None:
        found += 1
    return found


def peak_mb(path: Path) -> float:
    """Return the most memory that reading a log took in a process of its own, above what an idle one has."""
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as process:
        idle = process.submit(resident_mb).result()
        return process.submit(resident_mb, path).result() - idle


def resident_mb(path: Path | None = None) -> float:
    if path is not None:
        read_log(path)
    status = Path("/proc/self/status").read_text(encoding="ascii")  # getrusage would tell the parent's peak
    return int(re.search(r"VmHWM:\s*(\d+)", status)[1]) / 1024.0


def made_logs(folder: Path, megabytes: list[float]) -> list[Path]:
    """Record a practice flight and repeat it, boot after boot, each later on the recorder's clock."""
    records = recorded_flight("ardupilot", folder / "vehicle").records
    (begun_us,), (ended_us,) = (struct.unpack(">Q", records[row][:STAMP]) for row in (0, -1))
    length = sum(map(len, records))
    paths = []
    for size in megabytes:
        paths.append(folder / f"made-{size:.0f}.tlog")
        with paths[-1].open("wb") as stream:
            for boot in range(math.ceil(size * 1e6 / length)):
                later_us = boot * (ended_us - begun_us + PAUSE_US)
                for record in records:
                    stream.write(struct.pack(">Q", struct.unpack(">Q", record[:STAMP])[0] + later_us) + record[STAMP:])
    return paths


if __name__ == "__main__":
    main()
