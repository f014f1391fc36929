"""How a map was made, as words for its files."""

from __future__ import annotations

from datetime import UTC, datetime
from importlib.metadata import version
from typing import TYPE_CHECKING

import numpy as np

from sparsor import __version__
from sparsor.core.files import sha256_of

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from sparsor.design.decoders import Decoded
    from sparsor.fieldmap.measuring import Measured
    from sparsor.flightlog import Samples
    from sparsor.journeys.flown import FlownMission
    from sparsor.journeys.readings import Readings

HASH_DIGITS = 16


def map_facts(
    logs: Sequence[Path],
    mission: FlownMission,
    samples: Samples,
    readings: Readings,
    measured: Measured,
    decoded: Decoded,
) -> dict[str, str]:
    """Return names and values that say how a map was made; nothing in it depends on when."""
    model = mission.model
    tried = ", ".join(f"{name} {score:.3g}" for name, score in decoded.scores.items())
    settings = ", ".join(f"{name} {value:.4g}" for name, value in decoded.settings.items())
    return {
        "mission": mission.name,
        "logs": "; ".join(f"{path.name}, sha256 {sha256_of(path)[:HASH_DIGITS]}" for path in logs),
        "flown": _when(samples),
        "sensor": f"{samples.sensor}@{samples.sender} on vehicle {samples.system}, places from {samples.track}",
        "clock": clock_words(samples),
        "readings": readings.words,
        "samples_used": f"{int(measured.used.sum())} of {measured.used.size}",
        "cells_measured": f"{measured.cells.size} of {int(mission.allowed.sum())}",
        "drift": drift_words(measured, readings.unit),
        "decoder": f"{decoded.decoder}" + (f" ({settings})" if settings else ""),
        "decoders_tried": f"{tried} (expected |s - s'| / |s - mean(s)| on the model's validation maps)",
        "standard_deviation": f"scaled by {decoded.recalibration:.3g}, so that it held on the validation maps"
        + (f", and by {mission.widening:.3g} for maps of another size" if mission.widening > 1 else ""),
        "model": f"{model.provenance.get('source', 'unknown')}; windows of {model.window_m[0] / 1000:.4g} x "
        f"{model.window_m[1] / 1000:.4g} km",
        "software": ", ".join(
            (f"sparsor {__version__}", *(f"{name} {version(name)}" for name in ("numpy", "scipy", "rasterio")))
        ),
    }


def clock_words(samples: Samples) -> str:
    """Return by which clocks the samples were timed."""
    words = {
        "vehicle": "the vehicle's own",
        "companion": "the sender's own, mapped to the vehicle's",
        "receive": "arrival, for want of useful stamps",
        "file": "the table's",
    }
    parts = []
    for use in samples.clocks:
        if use.samples:
            rate = f" (rate {use.rate:.6g}, residual {use.residual_s:.2g} s)" if use.clock == "companion" else ""
            parts.append(words.get(use.clock, use.clock) + rate)
    return "; ".join(dict.fromkeys(parts)) or "none"


def drift_words(measured: Measured, unit: str) -> str:
    """Return what is known of the sensor's drift."""
    drift = measured.drift
    if not np.isfinite(drift.rate_per_h):
        return "not known: the route does not meet itself"
    known = f"{drift.rate_per_h:.3g} +- {drift.sd_per_h:.2g} {unit} an hour from {drift.revisits} revisits"
    return f"{known}, taken off" if drift.applied else f"{known}: not significant, left"


def _when(samples: Samples) -> str:
    known = samples.unix_s[np.isfinite(samples.unix_s)]
    if not known.size:
        return "unknown"
    first, last = (datetime.fromtimestamp(float(at), UTC) for at in (known.min(), known.max()))
    return f"{first:%Y-%m-%dT%H:%M:%SZ} to {last:%Y-%m-%dT%H:%M:%SZ}"
