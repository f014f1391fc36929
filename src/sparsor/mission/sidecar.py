"""The sidecar of a plan: everything that turning its log into a map needs."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from sparsor.errors import MissionError, ModelError, VehicleError
from sparsor.geodesy.box import BoundingBox
from sparsor.geodesy.grid import Grid
from sparsor.prior.model import Model, arrays_to_npz, model_arrays, model_from_arrays, read_npz
from sparsor.vehicle import SensorProfile

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from numpy.typing import NDArray

FORMAT = "sparsor sidecar 1"


@dataclass(frozen=True)
class Sidecar:
    """What a mission was planned with.

    Parameters
    ----------
    name : str
        Of the mission.
    grid : Grid
    allowed : array of bool (N,)
        Cells inside the area: those of the map.
    model : Model
    phi : array of bool (M, N)
        The planned measurement matrix.
    stops : array of int64 (n,)
        Planned cells in flight order.
    altitude_m, hold_s : float
        Height above home, or above the ground, and the longest dwell time at a stop.
    home : tuple of float
        Longitude, latitude (degrees) and altitude above mean sea level (m) of home.
    home_altitude_known : bool
        Whether that altitude was given; otherwise it is written as 0.
    lasso_weight : float
        The lambda the plan was made with.
    expected : mapping of str to float
        What the search expects of the flight.
    plans : mapping of str to str
        Plan file name to the SHA-256 of what was written, so that later edits are seen.
    sensor : SensorProfile or None
        What will measure, when that was said.
    passing : tuple of (longitude, latitude)
        Waypoints that only lead past a keep-out or over terrain and are no stops.
    kept_out : array of bool (N,) or None
        Cells inside the area that are not flown to, since they lie in a keep-out or its margin; None: nothing was
        said of them, in a sidecar of an earlier version.
    flown : array of int64 (k,)
        Of a resumed mission: stops that earlier flights measured already, in their flight order.
    heights_m : tuple of float
        Above home, of vehicles at once that fly each at their own; `altitude_m` is the lowest of them.
    rounds : mapping of str to int
        Of vehicles at once that take off more than once: plan file name to the round in which it is flown, from 1.
        Those of one round are in the air together, those of different rounds never are.
    above_ground : bool
        Whether `altitude_m` is above the ground, which `way` then follows.
    way : array of float64 (n, 3)
        Longitude, latitude (degrees) and height above home (m) of what is flown, where the height is not the same
        everywhere; else empty. A row of NaN stands between parts whose heights are above different homes, and before
        those of earlier flights of a resumed mission.
    """

    name: str
    grid: Grid
    allowed: NDArray[np.bool_]
    model: Model
    phi: NDArray[np.bool_]
    stops: NDArray[np.int64]
    altitude_m: float
    hold_s: float
    home: tuple[float, float, float]
    home_altitude_known: bool
    lasso_weight: float
    expected: Mapping[str, float]
    plans: Mapping[str, str]
    sensor: SensorProfile | None = None
    passing: tuple[tuple[float, float], ...] = ()
    kept_out: NDArray[np.bool_] | None = None
    flown: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    heights_m: tuple[float, ...] = ()
    rounds: Mapping[str, int] = field(default_factory=dict)
    above_ground: bool = False
    way: NDArray[np.float64] = field(default_factory=lambda: np.empty((0, 3)))


def sidecar_npz(sidecar: Sidecar) -> bytes:
    """Return the sidecar's file: plain arrays, never pickle."""
    about = {
        "format": FORMAT,
        "name": sidecar.name,
        "bbox": list(sidecar.grid.box.as_tuple()),
        "shape": list(sidecar.grid.shape),
        "altitude_m": sidecar.altitude_m,
        "hold_s": sidecar.hold_s,
        "home": list(sidecar.home),
        "home_altitude_known": sidecar.home_altitude_known,
        "lasso_weight": sidecar.lasso_weight,
        "expected": dict(sidecar.expected),
        "plans": dict(sidecar.plans),
    }
    if sidecar.passing:
        about["passing"] = [list(place) for place in sidecar.passing]
    if sidecar.heights_m:
        about["heights_m"] = list(sidecar.heights_m)
    if sidecar.rounds:
        about["rounds"] = dict(sidecar.rounds)
    if sidecar.above_ground:
        about["above_ground"] = True
        about["way"] = [[None if value != value else value for value in row] for row in sidecar.way.tolist()]
    if sidecar.sensor is not None:
        about["sensor"] = sidecar.sensor.model_dump(mode="json")
    return arrays_to_npz(
        {
            "sidecar": np.array(json.dumps(about, sort_keys=True)),
            "allowed": sidecar.allowed,
            "phi": sidecar.phi,
            "stops": sidecar.stops,
            **({} if sidecar.kept_out is None or not sidecar.kept_out.any() else {"kept_out": sidecar.kept_out}),
            **({"flown": sidecar.flown} if sidecar.flown.size else {}),
            **model_arrays(sidecar.model),
        }
    )


def read_sidecar(path: Path) -> Sidecar:
    """Read a sidecar.

    Raises
    ------
    MissionError
        When the file is missing, damaged or not a sidecar.
    """
    try:
        arrays = read_npz(path)
        about = json.loads(str(arrays["sidecar"]))
        _check_format(about["format"], path)
        return _from_arrays(about, arrays, model_from_arrays(arrays, f"'{path}'"))
    except ModelError as error:
        raise MissionError(str(error)) from None
    except VehicleError as error:
        raise MissionError(f"'{path}' holds a sensor that cannot be used: {error}") from None
    except MissionError:
        raise
    except (KeyError, IndexError, TypeError, ValueError, AttributeError, OverflowError, RecursionError) as error:
        raise MissionError(f"'{path}' is not a sidecar of sparsor ({error}); plan the mission again") from error


def _check_format(found: str, path: Path) -> None:
    if found != FORMAT:
        raise MissionError(f"'{path}' is a '{found}'; this version reads '{FORMAT}'")


def content_hash(content: bytes) -> str:
    """Return the SHA-256 that a sidecar remembers of a plan file."""
    return hashlib.sha256(content).hexdigest()


def _from_arrays(about: dict[str, Any], arrays: Mapping[str, NDArray[Any]], model: Model) -> Sidecar:
    grid = Grid(BoundingBox(*(float(side) for side in about["bbox"])), (about["shape"][0], about["shape"][1]))
    phi, stops, allowed = arrays["phi"], arrays["stops"].astype(np.int64), arrays["allowed"]
    flown = arrays.get("flown", np.zeros(0, dtype=np.int64)).astype(np.int64)
    fits = phi.ndim == 2 and phi.shape[1] == allowed.size == grid.size
    kept_out = arrays.get("kept_out")
    fits = fits and (kept_out is None or kept_out.size == grid.size)
    every = np.concatenate((stops, flown))
    if not fits or every.min(initial=0) < 0 or every.max(initial=0) >= grid.size:
        raise ValueError(f"its arrays do not fit a grid of {grid.shape[0]} x {grid.shape[1]}")
    return Sidecar(
        name=str(about["name"]),
        grid=grid,
        allowed=allowed.astype(np.bool_),
        model=model,
        phi=phi.astype(np.bool_),
        stops=stops,
        altitude_m=float(about["altitude_m"]),
        hold_s=float(about["hold_s"]),
        home=(float(about["home"][0]), float(about["home"][1]), float(about["home"][2])),
        home_altitude_known=bool(about["home_altitude_known"]),
        lasso_weight=float(about["lasso_weight"]),
        expected={str(key): float(value) for key, value in about["expected"].items()},
        plans={str(key): str(value) for key, value in about["plans"].items()},
        sensor=SensorProfile.from_mapping(about["sensor"], "its sensor") if "sensor" in about else None,
        passing=tuple((float(lon), float(lat)) for lon, lat in about.get("passing", ())),
        kept_out=None if kept_out is None else kept_out.astype(np.bool_),
        flown=flown,
        heights_m=tuple(float(height_m) for height_m in about.get("heights_m", ())),
        rounds={str(key): int(value) for key, value in about.get("rounds", {}).items()},
        above_ground=bool(about.get("above_ground", False)),
        way=np.array(about.get("way", []), dtype=np.float64).reshape(-1, 3),
    )
