"""A reconstructed map as rows for people and values for programs."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from sparsor.journeys.mapfacts import clock_words, drift_words

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from sparsor.journeys.reconstructing import Reconstruction

MOST_LISTED = 12


def map_rows(made: Reconstruction) -> list[tuple[str, str]]:
    """Return the rows of the summary table."""
    measured, decoded, unit = made.measured, made.decoded, made.readings.unit
    low, high = made.field_map.values[made.mission.allowed].min(), made.field_map.values[made.mission.allowed].max()
    others = f"; also in the log: {_listed(made.samples.others)}" if made.samples.others else ""
    return [
        ("sensor", f"{made.samples.sensor}@{made.samples.sender}, {made.readings.words}{others}"),
        ("samples", f"{int(measured.used.sum())} used{_left_out(made)}"),
        ("clock", clock_words(made.samples)),
        ("cells", f"{measured.cells.size} measured of {int(made.mission.allowed.sum())}{_missed(made)}"),
        ("drift", drift_words(measured, unit)),
        ("decoder", f"{decoded.decoder} (tried: {', '.join(decoded.scores)})"),
        ("map", f"{low:.4g} to {high:.4g} {unit}; level {decoded.level:.4g}, amplitude {decoded.amplitude:.3g}"),
        ("uncertainty", f"{made.field_map.typical_deviation:.3g} {unit}, the median standard deviation of a cell"),
        (
            "expected error",
            f"{decoded.expected_relative_error:.2f} of the map's contrast (|s - s'| / |s - mean(s)|), by the model's "
            "validation maps",
        ),
    ]


def map_values(made: Reconstruction, outputs: Sequence[Path]) -> dict[str, object]:
    """Return what --json prints; SI units in the key names, concentrations in `unit`."""
    measured, decoded, grid = made.measured, made.decoded, made.mission.grid
    lon_deg, lat_deg = grid.centres_deg(measured.missed)
    drift = measured.drift
    return {
        "samples": int(measured.used.sum()),
        "samples_left_out": {**measured.left_out, "without a position": made.samples.dropped.no_position},
        "cells_measured": int(measured.cells.size),
        "cells_missed": int(measured.missed.size),
        "missed_stops": [
            {"cell": int(cell), "lon_deg": round(float(lon), 7), "lat_deg": round(float(lat), 7)}
            for cell, lon, lat in zip(measured.missed, lon_deg, lat_deg, strict=True)
        ],
        "decoder": decoded.decoder,
        "clock": made.clock,
        "unit": made.readings.unit,
        "sensor": f"{made.samples.sensor}@{made.samples.sender}",
        "system": made.samples.system,
        "t90_s": made.readings.profile.t90_s,
        "level": decoded.level,
        "amplitude": decoded.amplitude,
        "expected_relative_error": decoded.expected_relative_error,
        "standard_deviation_median": made.field_map.typical_deviation,
        "noise_sd": float(measured.model.noise_sd),
        "drift_per_h": _or_none(drift.rate_per_h),
        "drift_sd_per_h": _or_none(drift.sd_per_h),
        "drift_taken_off": drift.applied,
        "decoders_tried": {name: float(score) for name, score in decoded.scores.items()},
        "others": list(made.samples.others),
        "outputs": [str(path) for path in outputs],
        "warnings": list(made.warnings),
    }


def _left_out(made: Reconstruction) -> str:
    reasons = [f"{count} {reason}" for reason, count in made.flown.left_out().items()]
    dropped = made.samples.dropped
    reasons += [f"{dropped.no_position} without a position"] if dropped.no_position else []
    reasons += [f"{dropped.not_finite} not a number"] if dropped.not_finite else []
    return f"; left out: {', '.join(reasons)}" if reasons else ""


def _missed(made: Reconstruction) -> str:
    missed = made.measured.missed
    if not missed.size:
        return ", no stop missed" if made.mission.stops.size else ""
    columns = made.mission.grid.shape[1]
    cells = [f"row {cell // columns} column {cell % columns}" for cell in missed.tolist()]
    return f", {missed.size} of {made.mission.stops.size} stops missed: {_listed(cells)}"


def _listed(names: Sequence[str]) -> str:
    more = f" and {len(names) - MOST_LISTED} more" if len(names) > MOST_LISTED else ""
    return ", ".join(names[:MOST_LISTED]) + more


def _or_none(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None
