"""What other budgets would give: the curve of expected error against the length of the flight."""

from __future__ import annotations

import csv
import io
from typing import TYPE_CHECKING

from sparsor.core.progress import Progress, silent
from sparsor.core.workers import Workers, workers_of
from sparsor.design import parse_budget
from sparsor.errors import InputError, MissionError
from sparsor.journeys.folder import CURVE_FILES
from sparsor.journeys.planning import PlannedMission, plan_prepared
from sparsor.journeys.preparing import prepare

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sparsor.mission.specification import MissionSpecification

SHARES = (0.4, 0.6, 0.8, 1.0, 1.3, 1.7, 2.2, 3.0)
"""Of the budget asked for."""
_UNITS = {"fraction": (100.0, "%"), "distance": (1.0, "m"), "time": (1.0, "s")}


def plan_with_curve(
    spec: MissionSpecification, *, workers: Workers | int | None = None, progress: Progress = silent
) -> tuple[PlannedMission, tuple[PlannedMission, ...]]:
    """Plan a mission, and the same for smaller and larger budgets; nothing is written.

    Parameters
    ----------
    spec : MissionSpecification
        With a budget.
    workers : Workers or int, optional
        As for `plan_mission`.
    progress : Progress

    Returns
    -------
    mission : PlannedMission
        The same as without the others.
    curve : tuple of PlannedMission
        It and the others, the smallest budget first; budgets that no mission can be made for are left out.

    Raises
    ------
    InputError
        As `plan_mission`; when the mission has no budget.
    """
    if spec.search.budget is None:
        raise MissionError("--pareto compares budgets, and this mission has none: give --budget, like 10%")
    hands = workers_of(workers)
    prepared = prepare(spec, workers=hands, progress=progress)
    mission = plan_prepared(spec, prepared, workers=hands, progress=progress)
    planned = {1.0: mission}
    before = mission
    for done, share in enumerate(shares := _other_shares(spec.search.budget), start=1):
        progress("other budgets", done - 1, len(shares))
        asked = spec.model_copy(
            update={"search": spec.search.model_copy(update={"budget": _scaled(spec.search.budget, share)})}
        )
        # A longer flight may begin as a shorter one that is known already.
        begin = [before.candidate.stops] if share > 1 else []
        try:
            planned[share] = before = plan_prepared(asked, prepared, begin=begin, workers=hands)
        except InputError:  # no route, too many items, a trigger with no dwell, vehicles too near to each other ...
            continue
        finally:
            progress("other budgets", done, len(shares))
    return mission, tuple(planned[share] for share in sorted(planned))


def curve_rows(curve: Sequence[PlannedMission]) -> list[dict[str, object]]:
    """Return the points of a curve as values for programs; SI units in the key names."""
    return [
        {
            "budget": one.specification.search.budget,
            "path_length_m": one.path_length_m,
            "path_length_cells": one.candidate.length_cells,
            "coverage_fraction": one.coverage_fraction,
            "flight_time_s": one.flight_time_s,
            "flyable": one.flyable,
            "sorties": len(one.plans),
            "stops": int(one.measured.stops.size),
            "cells_flown_over": one.cells_flown_over,
            "expected_relative_error": one.expected_relative_error,
        }
        for one in curve
    ]


def curve_files(mission: PlannedMission, curve: Sequence[PlannedMission]) -> dict[str, bytes]:
    """Return the table and the picture of a curve, by file name."""
    from sparsor.plot import BudgetCurve, budget_curve_png

    rows = curve_rows(curve)
    text = io.StringIO(newline="")
    writer = csv.DictWriter(text, fieldnames=list(rows[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    picture = budget_curve_png(
        BudgetCurve(
            title=f"{mission.specification.name}: what a longer or shorter flight would give",
            path_km=tuple(one.path_length_m / 1000 for one in curve),
            error=tuple(one.expected_relative_error for one in curve),
            minutes=tuple(one.flight_time_s / 60 for one in curve),
            flyable=tuple(one.flyable for one in curve),
            chosen=next(place for place, one in enumerate(curve) if one is mission),
            full_coverage_km=mission.place.full_coverage_m / 1000,
            vehicle=mission.vehicle.name,
            usable_min=mission.usable_s / 60,
        )
    )
    return dict(zip(CURVE_FILES, (text.getvalue().encode(), picture), strict=True))


def _other_shares(budget: str) -> list[float]:
    asked = parse_budget(budget)
    return [share for share in SHARES if share != 1.0 and (asked.measure != "fraction" or asked.value * share <= 1.0)]


def _scaled(budget: str, share: float) -> str:
    asked = parse_budget(budget)
    scale, unit = _UNITS[asked.measure]
    return f"{asked.value * share * scale:.6g}{unit}"
