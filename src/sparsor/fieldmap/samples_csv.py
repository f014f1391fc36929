"""The samples as a table."""

from __future__ import annotations

import csv
import io
import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from sparsor.fieldmap.fieldmap import FlownSamples

COLUMNS = ("time_s", "lon_deg", "lat_deg", "alt_m", "value", "clock", "used", "reason", "unix_s")


def samples_csv(samples: FlownSamples) -> bytes:
    """Return all samples as CSV, one a line, under `COLUMNS`; what is unknown is left empty.

    `used` is 1 where the map was made from the sample, else 0 and `reason` says why not. `sparsor reconstruct` reads
    such a table as a log.
    """
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(COLUMNS)
    columns = (
        _numbers(samples.time_s, ".6f"),
        _numbers(samples.lon_deg, ".8f"),
        _numbers(samples.lat_deg, ".8f"),
        _numbers(samples.alt_m, ".3f"),
        _numbers(samples.value, ".9g"),
        samples.clock.tolist(),
        samples.used.astype(int).tolist(),
        samples.reason.tolist(),
        _numbers(samples.unix_s, ".6f"),
    )
    writer.writerows(zip(*columns, strict=True))
    return stream.getvalue().encode()


def _numbers(values: NDArray[np.float64], form: str) -> list[str]:
    return [format(value, form) if math.isfinite(value) else "" for value in values.tolist()]
