"""A planned mission as values for programs and as a table for people."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from sparsor.journeys.planning import PlannedMission
    from sparsor.journeys.resuming import Before
    from sparsor.mission.specification import MissionSpecification


def mission_values(mission: PlannedMission, folder: Path) -> dict[str, object]:
    """Return what --json prints; SI units in the key names."""
    spec, found = mission.specification, mission.measured
    return {
        "plans": [str(folder / file) for file in mission.plan_files],
        "sidecar": str(folder / f"{spec.name}.npz"),
        "stops": int(found.stops.size),
        "cells_measured": int(found.phi.any(axis=0).sum()),
        "cells_flown_over": mission.cells_flown_over,
        "cells_mapped": int(mission.place.inside.sum()),
        "cells_kept_out": int((mission.place.inside & ~mission.place.allowed).sum()),
        "path_length_m": mission.path_length_m,
        "flown_length_m": mission.flown_length_m,
        "path_length_cells": found.length_cells,
        "coverage_fraction": mission.coverage_fraction,
        "flight_time_s": mission.flight_time_s,
        "endurance_used_s": mission.used_s,
        "endurance_s": mission.vehicle.endurance_s,
        "flyable": mission.flyable,
        "sorties": len(mission.plans),
        "stops_dropped": int(mission.sorties.dropped.size) if mission.sorties else 0,
        "vehicles": spec.flight.vehicles,
        "vehicles_apart_m": mission.sorties.apart_m if mission.sorties else None,
        "rounds": list(mission.sorties.rounds) if mission.sorties else [],
        "vehicle_of_each": list(mission.sorties.vehicles) if mission.sorties else [],
        "sortie_times_s": [time.seconds for time in mission.sorties.times] if mission.sorties else [],
        "expected_relative_error": mission.expected_relative_error,
        "expected_relative_error_cells": mission.expected_relative_error_cells,
        "planner": spec.search.planner,
        "probability": found.probability,
        "theta": found.theta,
        "cost": found.cost,
        "incoherence": found.incoherence,
        "terrain": None if mission.ground_facts is None else asdict(mission.ground_facts),
        "seed": spec.search.seed,
        **({} if mission.before is None else {"resumed": _resumed_values(mission.before, spec)}),
        "warnings": list(mission.warnings),
    }


def _resumed_values(before: Before, spec: MissionSpecification) -> dict[str, object]:
    return {
        "mission": before.mission.name,
        "logs": [str(path) for path in before.logs],
        "cells_measured": int(before.cells.size),
        "stops_measured": int(before.stops.size),
        "path_length_m": before.covered.length_m,
        "air_time_s": before.air_s,
        "budget": spec.search.budget,
    }


def mission_rows(mission: PlannedMission, *, details: bool) -> list[tuple[str, str]]:
    """Return the rows of the summary table; `details` adds what won and by what cost."""
    spec, found, vehicle = mission.specification, mission.candidate, mission.vehicle
    box = mission.place.grid.box
    rows, columns = mission.place.grid.shape
    model = mission.prior.model
    table = [
        (
            "box",
            f"{box.east_m / 1000:.4g} km east-west, {box.north_m / 1000:.4g} km north-south, {rows} x {columns} cells",
        ),
        *_map(mission),
        ("stops", _stops(mission)),
        (
            "distance",
            f"{mission.path_length_m / 1000:.2f} km over the stops, {mission.coverage_fraction:.1%} of full coverage "
            f"({mission.place.full_coverage_m / 1000:.0f} km); "
            f"{mission.flown_length_m / 1000:.2f} km with the way home",
        ),
        (
            "time in the air" if vehicle.flies else "time under way",
            f"{mission.flight_time_s / 60:.1f} min{_of_the_battery(mission)}; {vehicle.name}: "
            f"{vehicle.endurance_s / 60:.0f} min endurance, {mission.usable_s / 60:.0f} min less reserve",
        ),
        ("flyable", _flyable(mission)),
        (
            "expected error",
            f"{mission.expected_relative_error:.2f} of the map's contrast (|s - s'| / |s - mean(s)|, from the "
            + (
                ("cells flown over)" if mission.before is None else "cells of all flights together)")
                if mission.refined
                else f"{spec.search.rows} sums); {mission.expected_relative_error_cells:.2f} from single cells"
            )
            + ("" if mission.sorties is None else ", of what the sorties fly"),
        ),
        (
            "prior",
            f"{model.provenance.get('source', 'model')}, windows of {model.window_m[0] / 1000:.4g} x "
            f"{model.window_m[1] / 1000:.4g} km, {model.atoms} atoms",
        ),
    ]
    if mission.before is not None:
        before = mission.before
        table.insert(
            0,
            (
                "resumes",
                f"'{before.mission.name}': {before.cells.size} cells measured, {before.covered.length_m / 1000:.2f} of "
                f"{before.covered.total_m / 1000:.2f} km over the stops flown; budget of this flight: "
                f"{spec.search.budget}",
            ),
        )
    if mission.ground_facts is not None:
        over = mission.ground_facts
        table.append(
            (
                "over the ground",
                f"{over.least_m:.0f} to {over.most_m:.0f} m, {over.lowest_m:.0f} to {over.highest_m:.0f} m above home, "
                f"by {over.passed} waypoints beside the stops ({over.file})",
            )
        )
    if mission.sensor is not None:
        table.append(("sensor", mission.sensor.words))
    if details and spec.search.planner == "monte-carlo":
        weights = mission.weights
        table += [
            (
                "sample",
                f"r = {found.sample}, p = {found.probability:.4g}, theta = {found.theta}",
            ),
            (
                "cost",
                f"{found.cost:.6g} = {weights.valid:g} x {found.error:.6g} + {weights.path:.4g} x "
                f"{found.length_cells:.4g} + {weights.incoherence:.4g} x {found.incoherence:.4g}",
            ),
        ]
    return table


def _map(mission: PlannedMission) -> list[tuple[str, str]]:
    """Return the row of what the map is of, where it is not simply the box."""
    place = mission.place
    kept_out = int((place.inside & ~place.allowed).sum())
    if place.inside.all() and not kept_out:
        return []
    of = "" if place.shore is None else f" of {place.shore.side}"
    near = "" if place.shore is None else f"; coastline good to {place.shore.margin_m:g} m, kept as a margin"
    said = f", {kept_out} of them not flown to and estimated from around" if kept_out else ""
    return [("map", f"{int(place.inside.sum())} cells{of}{said}{near}")]


def _stops(mission: PlannedMission) -> str:
    stops, over = mission.measured.stops.size, mission.cells_flown_over
    if mission.candidate.dwells is None:
        return f"{stops} cells measured, {over} flown over"
    holds_s = [stop.hold_s for plan in mission.plans for stop in plan.stops if stop.hold_s > 0]
    dwells = f"; {sum(holds_s):g} s of dwelling at {len(holds_s)} of them" if holds_s else ", none dwelt at"
    return f"{stops} turning points{dwells}; {over} cells flown over and measured"


def _flyable(mission: PlannedMission) -> str:
    if not mission.flyable:
        return "no: a planning study (see the warnings)"
    if mission.sorties is None:
        return "yes, by endurance"
    if len(mission.plans) == 1:
        return f"yes, by endurance, in another order: {mission.sorties.times[0].seconds / 60:.1f} min"
    rounds = [", ".join(f"{one.seconds / 60:.1f}" for one in times) for times in mission.sorties.times_by_round]
    if len(rounds) > 1:
        return f"in {len(mission.plans)} flights, {len(rounds)} rounds: {'; '.join(rounds)} min"
    kind = "sorties" if mission.sorties.apart_m is None else "flights at once"
    return f"in {len(mission.plans)} {kind}: {rounds[0]} min"


def _of_the_battery(mission: PlannedMission) -> str:
    """Return the part of the endurance that is used, where that is not the time: hovering takes more than cruising."""
    if mission.used_s == mission.flight_time_s:
        return ""
    return f", as {mission.used_s / 60:.1f} min of cruising by power"


def curve_table(
    mission: PlannedMission, curve: Sequence[PlannedMission]
) -> tuple[tuple[str, ...], Sequence[tuple[str, ...]], str]:
    """Return column names, rows and title of the curve of error against budget; the planned one is marked."""
    names = ("budget", "km", "of full coverage", "min in the air", "flyable", "expected error")
    rows = [
        (
            f"{'> ' if one is mission else ''}{one.specification.search.budget}",
            f"{one.path_length_m / 1000:.2f}",
            f"{one.coverage_fraction:.1%}",
            f"{one.flight_time_s / 60:.1f}",
            ("yes" if len(one.plans) == 1 else f"in {len(one.plans)} sorties") if one.flyable else "no",
            f"{one.expected_relative_error:.3f}",
        )
        for one in curve
    ]
    return names, rows, "other budgets"
