"""What a file holds, in words and as plain values."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from math import inf
from typing import TYPE_CHECKING, Any

from sparsor.errors import MissionError
from sparsor.journeys.flown import is_edited, plan_changes, sidecar_of, with_passing
from sparsor.journeys.loginspection import inspect_log
from sparsor.mission import describe_plan, read_plan
from sparsor.mission.sidecar import read_sidecar
from sparsor.mission.specification import read_specification
from sparsor.prior.model import Model, model_from_arrays, read_npz

if TYPE_CHECKING:
    from pathlib import Path

    from sparsor.mission.sidecar import Sidecar

LOGS = frozenset({".tlog", ".bin", ".ulg", ".csv"})


@dataclass(frozen=True)
class Inspection:
    """What a file is and holds.

    Parameters
    ----------
    kind : {"plan", "model", "sidecar", "specification", "log"}
    contents : dict
        Plain values for JSON, SI units in the names.
    lines : tuple of str
        The same in words.
    """

    kind: str
    contents: dict[str, Any]
    lines: tuple[str, ...]


def inspect_file(path: Path) -> Inspection:
    """Say what a file holds.

    Raises
    ------
    InputError
        When there is no such file, its kind is unknown, or it is damaged.
    """
    if path.is_dir():
        plans = sorted(path.glob("*.plan"))
        if not plans:
            raise MissionError(f"'{path}' is a folder without a .plan; give a file")
        path = plans[0]
    if not path.is_file():
        raise MissionError(f"there is no file '{path}'")
    if path.suffix == ".plan":
        return _plan(path)
    if path.suffix == ".npz":
        arrays = read_npz(path)
        if "sidecar" in arrays:
            return _sidecar(read_sidecar(path), path)
        return _model(model_from_arrays(arrays, f"'{path}'"), path)
    if path.suffix == ".toml":
        return _specification(path)
    if LOGS.intersection(suffix.lower() for suffix in path.suffixes):
        return Inspection("log", *inspect_log(path))
    raise MissionError(
        f"'{path}' is of an unknown kind; known are .plan, .npz (model or sidecar), .toml and flight logs (.tlog, "
        ".BIN, .ulg, .csv)"
    )


def _plan(path: Path) -> Inspection:
    plan, sidecar = read_plan(path), sidecar_of(path)
    if sidecar is not None:
        plan = with_passing(plan, sidecar)
    description = describe_plan(plan)
    edited = None if sidecar is None else is_edited(path, sidecar)
    changes = plan_changes(plan, sidecar) if edited and sidecar is not None else ()
    lines = [f"{path}: a QGroundControl plan", *description.lines]
    if edited is not None:
        lines.append(
            "Edited since sparsor wrote it." if edited else "Unchanged since sparsor wrote it (by its sidecar)."
        )
    lines += [f"Changed: {change}" for change in changes]
    return Inspection("plan", {**asdict(description), "edited": edited, "changes": list(changes)}, tuple(lines))


def _model_contents(model: Model) -> dict[str, Any]:
    return {
        "shape": list(model.shape),
        "atoms": model.atoms,
        "centred": model.centred,
        "lasso": model.lasso_weight,
        "window_m": list(model.window_m),
        "scale": list(model.scale),
        "unit": model.unit,
        "validation_maps": len(model.validation),
        "kernel": asdict(model.kernel),
        "provenance": dict(model.provenance),
    }


def _model_lines(model: Model) -> list[str]:
    east_m, north_m = model.window_m
    return [
        f"Model of {model.shape[0]} x {model.shape[1]} cells, "
        f"windows of {east_m / 1000:.4g} x {north_m / 1000:.4g} km.",
        f"Dictionary: {model.provenance.get('dictionary', 'learned')}, {model.atoms} atoms, "
        f"{'centred' if model.centred else 'uncentred'}; lambda {model.lasso_weight:g}.",
        f"Scale: 0..1 is {model.scale[0]:.4g}..{model.scale[1]:.4g} {model.unit}.",
        f"Kernel: {model.kernel.words}.",
        f"{len(model.validation)} validation maps. From: {model.provenance.get('source', 'unknown')}.",
    ]


def _model(model: Model, path: Path) -> Inspection:
    return Inspection("model", _model_contents(model), (f"{path}: a model", *_model_lines(model)))


def _holds(sidecar: Sidecar) -> str:
    # Where every row of Phi is a cell flown over, the search chose where to dwell, and a stop may be flown through.
    each = "at most" if (sidecar.phi.sum(axis=1) == 1).all() else "each"
    return f"{sidecar.hold_s:g} s {each}"


def _kept_out(sidecar: Sidecar) -> str:
    count = 0 if sidecar.kept_out is None else int(sidecar.kept_out.sum())
    return f", {count} of them kept out of and estimated from around" if count else ""


def _above(sidecar: Sidecar) -> str:
    if not sidecar.above_ground:
        return "home"
    heights_m = sidecar.way[sidecar.way[:, 2] > -inf, 2]  # without what parts the way
    return f"the ground, {heights_m.min():g} to {heights_m.max():g} m above home"


def _sidecar(sidecar: Sidecar, path: Path) -> Inspection:
    box = sidecar.grid.box
    known = "" if sidecar.home_altitude_known else " (unknown, written as 0)"
    lines = (
        f"{path}: the sidecar of mission '{sidecar.name}'",
        f"Box: {' '.join(f'{side:g}' for side in box.as_tuple())} (west south east north), "
        f"{box.east_m / 1000:.4g} x {box.north_m / 1000:.4g} km; {int(sidecar.allowed.sum())} cells inside"
        f"{_kept_out(sidecar)}.",
        f"{sidecar.stops.size} stops at {sidecar.altitude_m:g} m above {_above(sidecar)}, {_holds(sidecar)}.",
        *((f"{sidecar.flown.size} more were measured by the flights that it resumes.",) if sidecar.flown.size else ()),
        f"Home: {sidecar.home[0]:.7f} E, {sidecar.home[1]:.7f} N, {sidecar.home[2]:g} m AMSL{known}.",
        f"Expected error: {sidecar.expected['relative_error']:.3f} of the map's contrast (|s - s'| / |s - mean(s)|).",
        *(() if sidecar.sensor is None else (f"Sensor: {sidecar.sensor.words}.",)),
        *_model_lines(sidecar.model),
    )
    contents = {
        "name": sidecar.name,
        "bbox": list(box.as_tuple()),
        "stops": int(sidecar.stops.size),
        "stops_flown_before": int(sidecar.flown.size),
        "altitude_m": sidecar.altitude_m,
        "above_ground": sidecar.above_ground,
        "hold_s": sidecar.hold_s,
        "home": list(sidecar.home),
        "home_altitude_known": sidecar.home_altitude_known,
        "expected": dict(sidecar.expected),
        "plans": dict(sidecar.plans),
        "sensor": None if sidecar.sensor is None else sidecar.sensor.model_dump(mode="json"),
        "model": _model_contents(sidecar.model),
    }
    return Inspection("sidecar", contents, lines)


def _specification(path: Path) -> Inspection:
    spec = read_specification(path)
    contents = spec.model_dump(mode="json", exclude_none=True)
    lines = [f"{path}: the specification of mission '{spec.name}'"]
    for section, values in contents.items():
        if isinstance(values, dict):
            lines += [f"{section}.{key}: {value}" for key, value in values.items()]
    return Inspection("specification", contents, tuple(lines))
