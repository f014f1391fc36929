#!/usr/bin/env python3
"""Read what a fuzzer driven by coverage makes of a small log: never anything raised but a LogError, never a hang.

    scripts/fuzz_coverage.py KIND SEED_FOLDER SECONDS

`fuzz_logs.py --atheris` starts it. The compiled loops run as plain Python here: in compiled code no branch is seen.
"""

from __future__ import annotations

import os
import sys
from contextlib import suppress

os.environ["NUMBA_DISABLE_JIT"] = "1"  # before numba is imported

import atheris

with atheris.instrument_imports(include=["sparsor", "pyulog"]):
    from sparsor.errors import LogError
    from sparsor.flightlog import samples
    from sparsor.flightlog.assembly import assemble
    from sparsor.flightlog.binlog import read_bin
    from sparsor.flightlog.table import read_table
    from sparsor.flightlog.tlog import read_tlog
    from sparsor.flightlog.ulog import read_ulog

FEW = 20  # so that long logs' ways are gone as well
READERS = {
    "tlog": lambda data: read_tlog([data], whole=FEW),
    "BIN": lambda data: read_bin([data], whole=FEW),
    "ulg": read_ulog,
    "CSV": lambda data: read_table([data]),
}


def main() -> None:
    kind, folder, seconds = sys.argv[1:]

    def one_input(data: bytes) -> None:
        try:
            log = assemble("fuzzed", READERS[kind](data))
        except LogError:
            return
        for values in log.values:
            with suppress(LogError):
                samples(log, sensor=f"{values.name}@{values.sender}")

    limits = [f"-max_total_time={seconds}", "-timeout=30", "-max_len=8000", "-print_final_stats=1", "-verbosity=0"]
    atheris.Setup([sys.argv[0], folder, *limits], one_input)
    atheris.Fuzz()


if __name__ == "__main__":
    main()
