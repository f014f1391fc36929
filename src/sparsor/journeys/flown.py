"""Which mission a log is of: a folder of ours, or anybody's plan with the box it was flown in."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from sparsor.core.progress import Progress, silent
from sparsor.errors import MissionError
from sparsor.geodesy import BoundingBox, Grid
from sparsor.journeys.folder import SPECIFICATION_FILE
from sparsor.journeys.modelling import choose_prior, size_difference
from sparsor.mission import read_plan
from sparsor.mission.items import FRAME_RELATIVE
from sparsor.mission.plan import flown_way
from sparsor.mission.sidecar import content_hash, read_sidecar
from sparsor.mission.specification import PriorSection

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from sparsor.mission import MissionPlan
    from sparsor.mission.sidecar import Sidecar
    from sparsor.prior.model import Model
    from sparsor.vehicle import SensorProfile


HEIGHT_M = 0.05


@dataclass(frozen=True, eq=False)
class FlownMission:
    """What turning a log into a map needs to know of the mission.

    Parameters
    ----------
    name : str
    folder : Path
        Where the map goes when nothing else is asked for.
    files : tuple of Path
        What it was read from; never written over.
    grid : Grid
    allowed : array of bool (N,)
        Cells inside the area.
    model : Model
    widening : float
        Factor, 1 or above, on the uncertainty where the model's windows are not of the box's size.
    stops : array of int64 (n,)
        Planned cells in flight order; of a resumed mission first those that earlier flights measured.
    altitude_m : float or None
        Height of the stops above home, or of the flight above the ground.
    way : array of float64 (n, 3) or None
        Longitude, latitude and height above home of what is flown, where the heights differ.
    phi : array of bool (M, N) or None
        The planned measurement matrix.
    sensor : SensorProfile or None
        What was said to measure, when the mission was planned.
    warnings : tuple of str
    earlier : int
        How many of the stops earlier flights measured, whose logs belong to the map too.
    home : tuple of float or None
        Longitude and latitude, degrees.
    heights_m : tuple of float
        Of vehicles at once, each its own.
    kept_out : array of bool (N,) or None
        Cells inside the area that are not flown to.
    """

    name: str
    folder: Path
    files: tuple[Path, ...]
    grid: Grid
    allowed: NDArray[np.bool_]
    model: Model
    widening: float
    stops: NDArray[np.int64]
    altitude_m: float | None
    way: NDArray[np.float64] | None
    phi: NDArray[np.bool_] | None
    sensor: SensorProfile | None
    warnings: tuple[str, ...]
    earlier: int = 0
    home: tuple[float, float] | None = None
    heights_m: tuple[float, ...] = ()
    kept_out: NDArray[np.bool_] | None = None

    @property
    def flown_to(self) -> NDArray[np.bool_]:
        """Cells that may be flown to, (N,): full coverage, which a budget in per cent is of, is over these."""
        return self.allowed if self.kept_out is None else self.allowed & ~self.kept_out

    @property
    def route(self) -> NDArray[np.int64]:
        """The stops of the mission's own plans, in flight order."""
        return self.stops[self.earlier :]


def mission_of_folder(folder: Path) -> FlownMission:
    """Return the mission that a folder holds; its sidecar suffices, the plan may have been edited or be gone.

    Raises
    ------
    MissionError
        When there is no such folder, or no sidecar in it.
    """
    path, sidecar = folder_sidecar(folder)
    widening, _ = size_difference(sidecar.model, sidecar.grid.box)
    plans = {name: folder / name for name in sidecar.plans if (folder / name).is_file()}
    stops, warnings = _stops_now(plans, sidecar)
    return FlownMission(
        name=sidecar.name,
        folder=folder,
        files=(path, folder / SPECIFICATION_FILE, *plans.values()),
        grid=sidecar.grid,
        allowed=sidecar.allowed,
        model=sidecar.model,
        widening=widening,
        stops=np.concatenate((sidecar.flown, stops)),
        altitude_m=sidecar.altitude_m,
        way=sidecar.way if len(sidecar.way) else None,
        phi=sidecar.phi,
        sensor=sidecar.sensor,
        warnings=warnings,
        earlier=sidecar.flown.size,
        home=sidecar.home[:2],
        heights_m=sidecar.heights_m,
        kept_out=sidecar.kept_out,
    )


def mission_of_plan(
    path: Path, bbox: tuple[float, float, float, float], model: Path | None, *, progress: Progress = silent
) -> FlownMission:
    """Return the mission of anybody's plan over a box.

    Parameters
    ----------
    path : Path
        A .plan.
    bbox : tuple of float
        West, south, east, north in degrees.
    model : Path or None
        What maps look like; None: the built-in model of the box's size.
    progress : Progress

    Raises
    ------
    MissionError, BoxError, ModelError
        When one of them cannot be used, or no stop of the plan lies in the box.
    """
    plan, box = read_plan(path), BoundingBox(*bbox)
    prior = choose_prior(PriorSection(model=model), box, progress=progress)
    grid = Grid(box, prior.model.shape)
    stops = stops_in_order(plan, grid)
    if not stops.size:
        sides = " ".join(f"{side:g}" for side in bbox)
        raise MissionError(
            f"none of the {len(plan.stops)} stops of '{path}' lies in the box {sides}: give the box that was flown "
            "(--bbox WEST SOUTH EAST NORTH)"
        )
    return FlownMission(
        name=path.stem,
        folder=Path(),
        files=(path, *(() if model is None else (model,))),
        grid=grid,
        allowed=np.ones(grid.size, dtype=np.bool_),
        model=prior.model,
        widening=prior.widening,
        stops=stops,
        altitude_m=_one_height_m(plan),
        way=_way_of_heights(plan),
        phi=None,
        sensor=None,
        warnings=prior.warnings,
    )


def _stops_now(plans: Mapping[str, Path], sidecar: Sidecar) -> tuple[NDArray[np.int64], tuple[str, ...]]:
    """Return the stops of a folder's plans as they are now, and what has to be said when they were edited."""
    edited = ", ".join(name for name, path in plans.items() if is_edited(path, sidecar))
    if not edited:
        return sidecar.stops, ()
    try:
        in_order = sorted(plans.values(), key=lambda path: (len(path.name), path.name))  # the tenth after the ninth
        flown = [stops_in_order(with_passing(read_plan(path), sidecar), sidecar.grid) for path in in_order]
    except MissionError as error:
        return sidecar.stops, (f"{edited} was changed and cannot be read: the stops are as planned ({error}).",)
    return np.concatenate(flown), (
        f"{edited} was edited since sparsor wrote it: missed stops are those of the edited plan "
        "('sparsor inspect' says what was changed).",
    )


def folder_sidecar(folder: Path) -> tuple[Path, Sidecar]:
    """Return the sidecar that a mission folder holds, and its path.

    Raises
    ------
    MissionError
        When there is no such folder, none in it, or several.
    """
    if not folder.is_dir():
        what = "is a file; for a plan give --plan and --bbox" if folder.exists() else "does not exist"
        raise MissionError(f"the mission folder '{folder}' {what}; give the folder that 'sparsor plan' wrote")
    found: dict[Path, Sidecar] = {}
    reasons = []
    for path in sorted(folder.glob("*.npz")):
        try:
            found[path] = read_sidecar(path)
        except MissionError as error:
            reasons.append(str(error))
    if len(found) == 1:
        return next(iter(found.items()))
    if found:
        names = ", ".join(path.name for path in found)
        raise MissionError(f"'{folder}' holds {len(found)} sidecars ({names}); keep one of them")
    raise MissionError(
        f"'{folder}' holds no sidecar (NAME.npz): {'; '.join(reasons) or 'there is no .npz in it'}; give the folder "
        "that 'sparsor plan' wrote, or --plan FILE.plan with --bbox"
    )


def sidecar_of(plan: Path) -> Sidecar | None:
    """Return the sidecar beside a plan that remembers it."""
    for candidate in sorted(plan.parent.glob("*.npz")):
        try:
            sidecar = read_sidecar(candidate)
        except MissionError:
            continue
        if plan.name in sidecar.plans:
            return sidecar
    return None


def is_edited(plan: Path, sidecar: Sidecar) -> bool:
    """Return whether a plan's file is no longer what its sidecar remembers."""
    return content_hash(plan.read_bytes()) != sidecar.plans.get(plan.name)


def stops_in_order(plan: MissionPlan, grid: Grid) -> NDArray[np.int64]:
    """Return the cells in which a plan stops, each once, in flight order; stops outside the grid are passed over."""
    cells = grid.cell_at([stop.lon_deg for stop in plan.stops], [stop.lat_deg for stop in plan.stops])
    return np.array(list(dict.fromkeys(cells[cells >= 0].tolist())), dtype=np.int64)


def with_passing(plan: MissionPlan, sidecar: Sidecar) -> MissionPlan:
    """Return a plan that was read with what its sidecar knows: which waypoints only lead past a keep-out."""
    places = set(sidecar.passing)
    known = tuple(index for index, item in enumerate(plan.items) if (item.params[5], item.params[4]) in places)
    return replace(plan, passing=known)


def plan_changes(plan: MissionPlan, sidecar: Sidecar) -> tuple[str, ...]:
    """Say in words how the stops of an edited plan differ from the planned ones, as far as the sidecar tells."""
    plan = with_passing(plan, sidecar)
    if len(sidecar.plans) > 1:
        return ()  # one of several sorties: which stops were its own is not known
    now, then = stops_in_order(plan, sidecar.grid), sidecar.stops
    gone, added = then[~np.isin(then, now)], now[~np.isin(now, then)]
    kept_now, kept_then = now[np.isin(now, then)], then[np.isin(then, now)]
    cells = sidecar.grid.cell_at([stop.lon_deg for stop in plan.stops], [stop.lat_deg for stop in plan.stops])
    height_m = _one_height_m(plan)
    over_ground, moved = sidecar.above_ground, _moved_up_or_down(plan, sidecar)
    said = (
        (gone.size, f"{gone.size} of {then.size} planned cells have no stop any more"),
        (added.size, f"{added.size} stops lie in cells that were not planned"),
        ((cells < 0).sum(), f"{int((cells < 0).sum())} stops lie outside the mission's box"),
        (not np.array_equal(kept_now, kept_then), "the stops come in another order"),
        (moved > 0, f"{moved} waypoints are at other heights than planned"),
        (height_m is None and not over_ground, "the stops are at different heights"),
        (
            height_m is not None and not over_ground and height_m != sidecar.altitude_m,
            f"the stops are at {height_m:g} m instead of {sidecar.altitude_m:g} m above home" if height_m else "",
        ),
    )
    words = tuple(sentence for holds, sentence in said if holds)
    return words or ("not the stops; home, fence, speeds or other items",)


def _moved_up_or_down(plan: MissionPlan, sidecar: Sidecar) -> int:
    """Return how many waypoints over terrain are at another height than was planned in their place."""
    planned = {(lon, lat): up_m for lon, lat, up_m in sidecar.way.tolist()}
    return sum((lon, lat) in planned and abs(planned[lon, lat] - up_m) > HEIGHT_M for lon, lat, up_m in flown_way(plan))


def _way_of_heights(plan: MissionPlan) -> NDArray[np.float64] | None:
    """Return what anybody's plan flies with its heights above home, where they differ and all are above home."""
    if _one_height_m(plan) is not None or any(stop.frame != FRAME_RELATIVE for stop in plan.stops):
        return None
    return np.array([(stop.lon_deg, stop.lat_deg, stop.altitude_m) for stop in plan.stops], dtype=np.float64)


def _one_height_m(plan: MissionPlan) -> float | None:
    """Return the height above home at which a plan stops everywhere, or None where there is no such height."""
    heights = {stop.altitude_m if stop.frame == FRAME_RELATIVE else None for stop in plan.stops}
    return heights.pop() if len(heights) == 1 else None
