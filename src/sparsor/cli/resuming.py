"""The options of `generate-mission --resume`: what goes with them, and what does not."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sparsor.errors import MissionError

if TYPE_CHECKING:
    from sparsor.core.progress import Progress
    from sparsor.journeys.resuming import Before
    from sparsor.mission.specification import MissionSpecification

# What is fixed by the mission that is resumed: the map's grid and model, and how the rest is searched for.
_FIXED = {
    "area": {"bbox": "--bbox", "file": "--area"},
    "prior": {
        "field": "--field",
        "variable": "--variable",
        "time": "--field-time",
        "field_bbox": "--field-bbox",
        "field_colormap": "--field-colormap",
        "field_range": "--field-range",
        "model": "--model",
        "atoms": "--atoms",
    },
    "search": {
        "paper": "--paper",
        "rows": "--rows",
        "probability": "--probability",
        "theta": "--theta",
        "lasso": "--lasso",
        "lambda_valid": "--lambda-valid",
        "lambda_path": "--lambda-path",
        "lambda_incoh": "--lambda-incoh",
    },
    "coast": {"side": "--land-only, --sea-only", "file": "--coastline", "accuracy_m": "--coastline-accuracy"},
    "flight": {"altitude_m": "--altitude", "terrain": "--terrain", "terrain_tolerance_m": "--terrain-tolerance"},
}


@dataclass(frozen=True)
class Flown:
    """What is told of the flight that was cut."""

    mission: Path | None
    logs: tuple[Path, ...]
    sensor: str | None
    calibration: Path | None

    @property
    def is_asked(self) -> bool:
        """Whether any of it was given."""
        return bool(self.logs) or (self.mission, self.sensor, self.calibration) != (None, None, None)


def check_asked(flown: Flown, given: dict[str, Any], mission_file: Path | None, *, pareto: bool) -> None:
    """Refuse options that do not belong together.

    Raises
    ------
    MissionError
    """
    if not flown.logs:
        present = {"--mission": flown.mission, "--sensor": flown.sensor, "--calibration": flown.calibration}
        names = ", ".join(name for name, value in present.items() if value is not None)
        raise MissionError(f"{names} only makes sense with --resume LOG, the log of a flight that was cut")
    if flown.mission is None:
        raise MissionError("--resume needs the mission that the log is of: give its folder (--mission DIR)")
    if mission_file is not None:
        raise MissionError(
            f"--resume reads the mission.toml of --mission '{flown.mission}': leave '{mission_file}' out"
        )
    check_given(given, pareto=pareto)


def check_given(given: dict[str, Any], *, pareto: bool) -> None:
    """Refuse options that make no sense for a mission that resumes another.

    Raises
    ------
    MissionError
    """
    names = [
        option
        for section, options in _FIXED.items()
        for name, option in options.items()
        if (given.get(section) or {}).get(name) is not None
    ]
    names += ["--planner"] if given["search"]["planner"] not in (None, "refined") else []
    names += ["--pareto"] if pareto else []
    if names:
        raise MissionError(
            f"{', '.join(names)}: not with a mission that is resumed: its box, coast, height and model are those that "
            "it was flown with, and the rest is planned by the refined search; leave it out"
        )


def resumed_request(
    flown: Flown, given: dict[str, Any], output: Path | None, progress: Progress
) -> tuple[MissionSpecification, Path, Before]:
    """Return what is asked for, the folder it goes to (beside the one flown), and what was flown."""
    from sparsor.journeys.resuming import resumed_specification

    assert flown.mission is not None
    spec, before = resumed_specification(
        flown.mission,
        flown.logs,
        given,
        base=Path.cwd(),
        sensor=flown.sensor,
        calibration=flown.calibration,
        progress=progress,
    )
    return spec, output or flown.mission.parent / spec.name, before
