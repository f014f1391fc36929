"""From the samples of a flight to what a decoder takes: composes the steps, holds no algorithm."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from sparsor.errors import LogError
from sparsor.fieldmap.cellwise import in_cells
from sparsor.fieldmap.faults import FAULTS, Reason, fit_without_spikes, sensor_faults
from sparsor.fieldmap.mission_part import OUTSIDE, missed_stops, mission_part
from sparsor.fieldmap.observing import observe, passes_of, places_of
from sparsor.fieldmap.path import DWELL_M_S, path_of
from sparsor.fieldmap.response import TAU_PER_T90, quicker_fits_better

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from sparsor.design.decoders.measurements import Measurements
    from sparsor.fieldmap.drift import Drift
    from sparsor.fieldmap.mission_part import MissionPart
    from sparsor.fieldmap.response import AirModel
    from sparsor.flightlog.sampling import Samples
    from sparsor.geodesy.grid import Grid
    from sparsor.vehicle.sensor import SensorProfile

_BEFORE_S = 300.0  # of the way to the mission: what the sensor holds when it begins
_NOISE_DIFFERS = 2.0


@dataclass(frozen=True, eq=False)
class Measured:
    """What a flight measured.

    Parameters
    ----------
    measurements : Measurements
        For a decoder: one row a cell, with the shares of the cells whose air its readings hold.
    cells : array of int64 (k,)
        Cells in which something was measured, ascending.
    cell_value, cell_sd : array of float64 (k,)
        The air in each of them by its own samples, response undone, and how far that may be off.
    counts : array of int64 (k,)
        Samples used of each.
    used : array of bool (n,)
    reason : array of str (n,)
        A `Reason` for each sample; empty for those used.
    air, air_sd : array of float64 (n,)
        The air at each sample, response undone, drift not taken off; NaN far from the mission.
    speed_m_s : array of float64 (n,)
        NaN far from the mission.
    dwelling : array of bool (n,)
        Slower than `DWELL_M_S`.
    model : AirModel
        What was fitted, with the noise of a reading.
    drift : Drift
    scatter_sd : float
        Between passes of one cell, beyond the noise: part of `cell_sd`, and of the measurements' variance as far as the
        field's slope does not explain it.
    missed : array of int64 (m,)
        Planned stops in whose cell nothing was measured, in flight order.
    warnings : tuple of str
    """

    measurements: Measurements
    cells: NDArray[np.int64]
    cell_value: NDArray[np.float64]
    cell_sd: NDArray[np.float64]
    counts: NDArray[np.int64]
    used: NDArray[np.bool_]
    reason: NDArray[np.str_]
    air: NDArray[np.float64]
    air_sd: NDArray[np.float64]
    speed_m_s: NDArray[np.float64]
    dwelling: NDArray[np.bool_]
    model: AirModel
    drift: Drift
    scatter_sd: float
    missed: NDArray[np.int64]
    warnings: tuple[str, ...]

    @property
    def left_out(self) -> dict[str, int]:
        """How many samples were not used, by reason."""
        return dict(Counter(str(reason) for reason in self.reason if reason))


def measure(
    samples: Samples,
    grid: Grid,
    profile: SensorProfile,
    *,
    value: NDArray[np.float64] | None = None,
    t90_s: float | None = None,
    stops: NDArray[np.int64] | None = None,
    altitude_m: float | None = None,
    way: NDArray[np.float64] | None = None,
    heights_m: Sequence[float] = (),
) -> Measured:
    """Return what a flight measured, with what was left out and why.

    Parameters
    ----------
    samples : Samples
        As logged; the sensor's faults are looked for in these.
    grid : Grid
    profile : SensorProfile
    value : array of float64 (n,), optional
        The samples' concentrations, where a calibration or another unit changed them; NaN where they are unknown.
    t90_s : float, optional
        Instead of the profile's; 0 leaves the readings as they are.
    stops : array of int64 (m,), optional
        Planned cells in flight order.
    altitude_m : float, optional
        The mission's height above home, or above the ground.
    way : array of float64 (k, 3), optional
        Longitude, latitude and height above home of what was to be flown, where the heights differ.
    heights_m : sequence of float
        Heights of several vehicles at once.

    Raises
    ------
    LogError
        When no sample lies inside the grid, or none of those is of use.
    DesignError
        When fewer than two cells were measured.
    """
    part = mission_part(samples, grid, altitude_m, way, heights_m=heights_m)
    reading = samples.value if value is None else value
    reason = sensor_faults(samples.time_s, samples.boot, samples.value, profile)
    reason[np.isnan(reading)] = Reason.UNCALIBRATED
    rows = _around_the_mission(samples, part)
    near = _taken(samples, rows)
    path = path_of(near)
    model, air, spike = fit_without_spikes(
        path,
        reading[rows],
        reason[rows] == Reason.USED,
        t90_s=profile.t90_s if t90_s is None else t90_s,
        noise_sd=profile.noise_sd,
    )
    reason[rows[spike]] = Reason.SPIKE
    reason[part.cell == OUTSIDE] = Reason.OUTSIDE
    reason[~part.in_flight] = Reason.NOT_IN_FLIGHT
    used = reason == Reason.USED
    if not used.any():
        raise LogError(f"none of the {used.size} samples is of use: {_counted(reason)}")
    cell = np.where(part.in_flight, part.cell, OUTSIDE)[rows]
    passes = passes_of(cell, path.start, used[rows])
    places = places_of(grid, near.lon_deg, near.lat_deg, cell != OUTSIDE)
    observations = observe(model, air, path, reading[rows], places, passes, grid)
    if observations.rows.size == 0:
        raise LogError(
            f"the readings hold mostly air from before the mission: with a t90 of {model.tau_s / TAU_PER_T90:g} s its "
            f"{int(used.sum())} samples are too few; give a longer log or the sensor's own t90"
        )
    found = in_cells(near, grid, model, air, passes, observations, profile.drift_sd_per_h)
    missed = np.zeros(0, dtype=np.int64) if stops is None else missed_stops(stops, found.cells)
    speed_m_s = _spread_out(path.speed_m_s(), rows, used.size)
    too_quick = quicker_fits_better(model, path, reading[rows], used[rows])
    return Measured(
        measurements=found.measurements,
        cells=found.cells,
        cell_value=found.value,
        cell_sd=found.sd,
        counts=np.bincount(part.cell[used], minlength=grid.size)[found.cells],
        used=used,
        reason=reason,
        air=_spread_out(air.value, rows, used.size),
        air_sd=_spread_out(np.sqrt(air.variance), rows, used.size),
        speed_m_s=speed_m_s,
        dwelling=speed_m_s < DWELL_M_S,
        model=model,
        drift=found.drift,
        scatter_sd=found.scatter_sd,
        missed=missed,
        warnings=(*part.warnings, *_warnings(reason, model, profile, found.drift, missed, too_quick=too_quick)),
    )


def _around_the_mission(samples: Samples, part: MissionPart) -> NDArray[np.intp]:
    """Return the samples of each boot from shortly before the mission to its end."""
    near = np.zeros(samples.time_s.size, dtype=np.bool_)
    on_it = part.in_flight & (part.cell != OUTSIDE)
    for boot in np.unique(samples.boot[on_it]):
        own = samples.boot == boot
        time_s = samples.time_s[own & on_it]
        near |= own & (samples.time_s >= time_s.min() - _BEFORE_S) & (samples.time_s <= time_s.max())
    return np.flatnonzero(near)


def _taken(samples: Samples, rows: NDArray[np.intp]) -> Samples:
    every = {one.name: getattr(samples, one.name) for one in fields(samples)}
    taken: dict[str, Any] = {name: row[rows] for name, row in every.items() if isinstance(row, np.ndarray)}
    return replace(samples, **taken)


def _spread_out(near: NDArray[np.float64], rows: NDArray[np.intp], size: int) -> NDArray[np.float64]:
    values = np.full(size, np.nan)
    values[rows] = near
    return values


def _counted(reasons: NDArray[np.str_]) -> str:
    counts = Counter(str(reason) for reason in reasons if reason)
    return ", ".join(f"{count} {reason}" for reason, count in counts.most_common())


def _warnings(
    reason: NDArray[np.str_],
    model: AirModel,
    profile: SensorProfile,
    drift: Drift,
    missed: NDArray[np.int64],
    *,
    too_quick: bool,
) -> list[str]:
    found = []
    if too_quick:
        found.append(
            f"the readings change faster than a t90 of {model.tau_s / TAU_PER_T90:g} s lets them; if that is not the "
            "sensor's own, the map is wrong: give it with --t90, 0 for a sensor that answers at once"
        )
    flown = (reason != Reason.NOT_IN_FLIGHT) & (reason != Reason.OUTSIDE)
    faulty = reason[flown & np.isin(reason, [str(fault) for fault in FAULTS])]
    if faulty.size:
        found.append(f"{faulty.size} of {int(flown.sum())} samples inside the grid were left out: {_counted(faulty)}")
    if model.noise_sd > _NOISE_DIFFERS * profile.noise_sd > 0:
        found.append(
            f"the readings' noise is {model.noise_sd:.3g} {profile.unit}, the profile '{profile.name}' says "
            f"{profile.noise_sd:g}: what was found counts"
        )
    if drift.applied:
        found.append(
            f"the sensor drifted by {drift.rate_per_h:.3g} +- {drift.sd_per_h:.2g} {profile.unit} an hour, told from "
            f"{drift.revisits} passes near earlier ones: taken off"
        )
    if missed.size:
        found.append(f"{missed.size} planned stop(s) were missed: no sample lies in their cells")
    return found
