#!/usr/bin/env python3
"""Time our .tlog reader against pymavlink's, side by side in one run, and compare what they find.

    scripts/bench/tlog_speed.py [LOG.tlog ...] [--repeats 5] [--megabytes 100]

Without a log it records a flight of the practice autopilot and repeats it, boot after boot, to 100 MB. Both decode
the messages that a map needs and pass over the others; pymavlink through `mavlink_connection`. The peak of memory is
that of a process of its own (Linux).
"""

from __future__ import annotations

import argparse
import re
import struct
import sys
import tempfile
import time
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

from pymavlink import mavutil
from pymavlink.dialects.v20 import ardupilotmega as mavlink
from stopwatch import fastest

from sparsor.core.mavlink_scan import STAMP
from sparsor.flightlog import read_log
from sparsor.flightlog.messages import WANTED, read_messages
from sparsor.flightlog.opening import LogFile

sys.path.insert(0, str(Path(__file__).parents[2] / "tests"))  # the recorded practice flight is the tests'
from flightlog.recorded import recorded_flight

PAUSE_US = 60_000_000


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("logs", nargs="*", type=Path)
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--megabytes", type=float, default=100.0, help="of the log that is made")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        logs = options.logs or [made_log(Path(folder) / "made.tlog", options.megabytes)]
        read_log(logs[0])  # compiled now
        for path in logs:
            report(path, options.repeats)


def report(path: Path, repeats: int) -> None:
    start = time.perf_counter()
    theirs = pymavlink_count(path)
    pymavlink_s = time.perf_counter() - start
    frames_s, ours = fastest(lambda: count(path), repeats)
    log_s, _ = fastest(lambda: read_log(path), repeats)
    size = path.stat().st_size
    print(f"{path.name}: {size / 1e6:.1f} MB, {ours} wanted messages, by pymavlink {theirs}")
    print(f"  pymavlink            {pymavlink_s:8.3f} s  {size / pymavlink_s / 1e6:8.1f} MB/s")
    print(
        f"  our messages         {frames_s:8.3f} s  {size / frames_s / 1e6:8.1f} MB/s  {pymavlink_s / frames_s:6.0f} x"
    )
    print(f"  our whole flight log {log_s:8.3f} s  {size / log_s / 1e6:8.1f} MB/s  {pymavlink_s / log_s:6.0f} x")
    print(f"  our peak of memory   {peak_mb(path):8.0f} MB")


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


def made_log(path: Path, megabytes: float) -> Path:
    """Record a practice flight and repeat it, boot after boot, each later on the recorder's clock."""
    records = recorded_flight("ardupilot", path.with_suffix(".vehicle")).records
    (begun_us,), (ended_us,) = (struct.unpack(">Q", records[row][:STAMP]) for row in (0, -1))
    with path.open("wb") as stream:
        while stream.tell() < megabytes * 1e6:
            later_us = stream.tell() // sum(map(len, records)) * (ended_us - begun_us + PAUSE_US)
            for record in records:
                stream.write(struct.pack(">Q", struct.unpack(">Q", record[:STAMP])[0] + later_us) + record[STAMP:])
    return path


if __name__ == "__main__":
    main()
