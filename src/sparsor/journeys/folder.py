"""A mission's folder: what is in it, whether it may be written, writing it whole."""

from __future__ import annotations

import re
from contextlib import suppress
from typing import TYPE_CHECKING

import numpy as np

from sparsor.core.files import write_files
from sparsor.errors import MissionError
from sparsor.mission import export_bytes, plan_bytes
from sparsor.mission.plan import flown_way
from sparsor.mission.sidecar import Sidecar, content_hash, sidecar_npz
from sparsor.mission.specification import read_specification, specification_toml

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from numpy.typing import NDArray

    from sparsor.journeys.planning import PlannedMission
    from sparsor.mission.specification import MissionSpecification

SPECIFICATION_FILE = "mission.toml"
PREVIEW_FILE = "preview.png"
TERRAIN_FILE = "terrain.png"
CURVE_FILES = ("pareto.csv", "pareto.png")


def check_folder(spec: MissionSpecification, folder: Path, *, force: bool) -> None:
    """Refuse to write over another mission, or over what this one is made from.

    A folder is free when it is empty or its mission.toml asks for the same.

    Raises
    ------
    MissionError
    """
    for path in (folder, *folder.parents):
        if path.is_file():
            raise MissionError(f"'{path}' is a file; give a folder with -o")
    written = {(folder / file).resolve() for file in _files(spec)}
    for path in spec.inputs:
        sortie = path.resolve().parent == folder.resolve() and _of_sorties(spec).fullmatch(path.name)
        if sortie or path.resolve() in written:
            raise MissionError(
                f"'{path}' is read for this mission and would be written over: choose another --name or -o"
            )
    if force or not folder.exists() or not any(folder.iterdir()):
        return
    if (folder / SPECIFICATION_FILE).is_file():
        try:
            same = read_specification(folder / SPECIFICATION_FILE) == spec
        except MissionError:
            same = False
        if same:
            return
    raise MissionError(
        f"'{folder}' holds something else already, or this mission with other settings: choose another --name or -o, "
        "or write over it with --force"
    )


def write_mission(
    mission: PlannedMission, folder: Path, *, preview: bool = True, beside: Mapping[str, bytes] | None = None
) -> dict[str, Path]:
    """Write a mission's folder, all of its files or none; return what is where.

    What an earlier mission in the folder consisted of, by its mission.toml, and this one does not make, is
    removed, so that no old route lies beside the new one.

    Parameters
    ----------
    mission : PlannedMission
    folder : Path
    preview : bool
        Whether the picture is drawn.
    beside : mapping of str to bytes, optional
        Further files, by name.

    Raises
    ------
    OutputError
        When the folder cannot be written.
    """
    spec = mission.specification
    contents = {SPECIFICATION_FILE: specification_toml(spec, folder)}
    for file, plan in zip(mission.plan_files, mission.plans, strict=True):
        contents[file] = plan_bytes(plan)
        stem = file.removesuffix(".plan")
        contents |= {f"{stem}.{export}": export_bytes(plan, stem, export) for export in spec.output.export}
    hashes = {file: content_hash(content) for file, content in contents.items() if file.endswith(".plan")}
    contents[f"{spec.name}.npz"] = sidecar_npz(_sidecar(mission, hashes))
    if preview:
        from sparsor.journeys.preview import preview_png

        contents[PREVIEW_FILE] = preview_png(mission)
        if mission.ground is not None:
            from sparsor.journeys.heightprofile import terrain_png

            contents[TERRAIN_FILE] = terrain_png(mission)
    contents |= beside or {}
    inputs = {path.resolve() for path in spec.inputs}
    stale = {folder / file for file in _files_before(folder) - contents.keys()}
    write_files(folder, contents)
    for path in stale:
        if path.resolve() not in inputs:
            path.unlink(missing_ok=True)
    return {file: folder / file for file in contents}


def _files(spec: MissionSpecification) -> set[str]:
    """Return the names of the files that a mission consists of."""
    suffixes = ("plan", "npz", *spec.output.export)
    return {
        SPECIFICATION_FILE,
        PREVIEW_FILE,
        TERRAIN_FILE,
        *CURVE_FILES,
        *(f"{spec.name}.{suffix}" for suffix in suffixes),
    }


def _files_before(folder: Path) -> set[str]:
    """Return the names of the files of the mission that is in a folder now, by its own specification."""
    with suppress(MissionError):
        spec = read_specification(folder / SPECIFICATION_FILE)
        return _files(spec) | {path.name for path in folder.iterdir() if _of_sorties(spec).fullmatch(path.name)}
    return set()


def _of_sorties(spec: MissionSpecification) -> re.Pattern[str]:
    """Return what the files of a mission's sorties are called."""
    return re.compile(rf"{re.escape(spec.name)}-\d+\.({'|'.join(('plan', *spec.output.export))})")


def _sidecar(mission: PlannedMission, hashes: dict[str, str]) -> Sidecar:
    plan, candidate, flight = mission.plans[0], mission.measured, mission.specification.flight
    passed = [(one.items[index].lon_deg, one.items[index].lat_deg) for one in mission.plans for index in one.passing]
    before, phi = mission.before, candidate.phi
    if before is not None:  # the map is made of all flights together
        cells = np.zeros(phi.shape[1], dtype=np.bool_)
        cells[before.cells] = True
        phi = np.eye(phi.shape[1], dtype=np.bool_)[cells | phi.any(axis=0)]
    return Sidecar(
        name=mission.specification.name,
        grid=mission.place.grid,
        allowed=mission.place.inside,
        kept_out=mission.place.inside & ~mission.place.allowed,
        model=mission.prior.model,
        phi=phi,
        stops=candidate.stops,
        altitude_m=flight.altitude_m,
        hold_s=max(stop.hold_s for one in mission.plans for stop in one.stops),
        home=(plan.home.lon_deg, plan.home.lat_deg, plan.home.alt_amsl_m),
        home_altitude_known=plan.home.altitude_known,
        lasso_weight=mission.specification.search.lasso or mission.prior.model.lasso_weight,
        expected={
            "relative_error": mission.expected_relative_error,
            "relative_error_cells": mission.expected_relative_error_cells,
            "cost": candidate.cost,
            "squared_error": candidate.error,
            "path_length_cells": candidate.length_cells,
            "incoherence": candidate.incoherence,
        },
        plans=hashes,
        sensor=mission.sensor,
        passing=tuple(passed),
        flown=np.zeros(0, dtype=np.int64) if before is None else before.stops,
        heights_m=_heights_m(mission),
        rounds=_rounds(mission),
        above_ground=mission.ground is not None,
        way=_way(mission),
    )


def _heights_m(mission: PlannedMission) -> tuple[float, ...]:
    """Return the heights of vehicles at once, those of the mission that is resumed among them."""
    new = () if mission.sorties is None else tuple(dict.fromkeys(mission.sorties.heights_m))
    old = () if mission.before is None else mission.before.mission.heights_m
    if mission.before is None or not (new or old):
        return new
    one = (mission.specification.flight.altitude_m,)
    return tuple(sorted({*(new or one), *(old or one)}))


def _rounds(mission: PlannedMission) -> dict[str, int]:
    """Return the round of each plan, where there are several."""
    rounds = () if mission.sorties is None else mission.sorties.rounds
    return dict(zip(mission.plan_files, rounds, strict=True)) if max(rounds, default=1) > 1 else {}


def _way(mission: PlannedMission) -> NDArray[np.float64]:
    """Return what is flown at heights over terrain; parts that begin at another home, and earlier flights, apart."""
    apart = (np.nan, np.nan, np.nan)
    way: list[tuple[float, ...]] = []
    if mission.ground is not None:
        for plan, before in zip(mission.plans, (mission.plans[0], *mission.plans), strict=False):
            way += [*([apart] if plan.home != before.home else []), *flown_way(plan)]
    found = np.array(way, dtype=np.float64).reshape(-1, 3)
    earlier = None if mission.before is None else mission.before.mission.way
    return found if earlier is None or not way else np.concatenate((found, [apart], earlier))
