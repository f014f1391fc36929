"""A program of its own: routes by SGP-Tools 2.x and PySensors, through their own interfaces.

It runs in the Python that has them (`peer_routes` starts it), which may be another than ours, and knows nothing of
sparsor: arrays come and go as .npz.

    program.py GIVEN.npz FOUND.npz

GIVEN holds `maps` (n, N) for training, `shape`, `limits` (budgets, cell units) and `steps` of the optimiser. FOUND
holds for each answer an array of cells named `PLANNER|LIMIT|KIND`, in the order of its own tour where it makes one,
and its seconds as `PLANNER|LIMIT|KIND|seconds`.
"""

from __future__ import annotations

import sys
import time
from importlib.util import find_spec
from typing import Any

import numpy as np

Array = Any  # numpy's, of whatever version is there

_TOUR = 0.7124  # a tour of n random points in an area A is about this times sqrt(n A) long
_SHARES = (0.55, 0.75, 0.95)  # of the points that would fill the budget at random
_KERNEL_MAPS = 8
_KERNELS = ("SquaredExponential", "Matern32", "Exponential")
_LEAST_NOISE = 1e-4  # GPflow refuses what lies at its bound of 1e-6


def main() -> None:
    """Read what is asked and write what is found."""
    given = np.load(sys.argv[1])
    found: dict[str, Any] = {}
    maps, shape, steps = given["maps"], tuple(given["shape"].tolist()), int(given["steps"])
    places = np.stack(np.divmod(np.arange(maps.shape[1]), shape[1]), axis=1).astype(np.float64)
    kernels = fitted_kernels(maps, places, steps) if find_spec("sgptools") else {}
    for limit in given["limits"].tolist():
        counts = sorted({max(3, round(share * (limit / _TOUR) ** 2 / maps.shape[1])) for share in _SHARES})
        if find_spec("pysensors"):
            found |= pysensors(maps, limit, counts)
        for name, kernel in kernels.items():
            found |= sgptools(name, kernel, places, shape, limit, counts, steps)
    np.savez(sys.argv[2], **found)


def pysensors(maps: Array, limit: float, counts: list[int]) -> dict[str, Any]:
    """Return QR and cost-constrained QR placements: rankings of as many cells as modes."""
    from pysensors import SSPOR
    from pysensors.basis import SVD
    from pysensors.optimizers import CCQR, QR

    found: dict[str, Any] = {}
    side = round(maps.shape[1] ** 0.5)
    row, column = np.divmod(np.arange(maps.shape[1]), side)
    # Cost of a cell: how far it lies from the centre, on the scale of the basis' rows.
    away = np.hypot(row - (side - 1) / 2, column - (side - 1) / 2) / side
    for modes in counts:
        for name, optimizer in (("QR", QR()), ("CCQR", CCQR(sensor_costs=0.05 * away))):
            begun = time.perf_counter()
            model = SSPOR(basis=SVD(n_basis_modes=modes), optimizer=optimizer).fit(maps - maps.mean(axis=0), quiet=True)
            ranking = model.get_all_sensors()[:modes]
            found |= answer(f"PySensors {name}", limit, f"ranking by {modes} modes", ranking, begun)
    return found


def fitted_kernels(maps: Array, places: Array, steps: int) -> dict[str, Any]:
    """Return kernels and noises as SGP-Tools fits them to training maps."""
    import gpflow
    from sgptools.utils.gpflow import get_model_params

    chosen = maps[np.linspace(0, len(maps) - 1, _KERNEL_MAPS).round().astype(int)]
    values = ((chosen - chosen.mean(axis=1, keepdims=True)) / chosen.std()).T
    kernels = {}
    for name in _KERNELS:
        kernel = getattr(gpflow.kernels, name)(variance=1.0, lengthscales=4.0)
        options = {"noise_variance": 1e-2, "max_steps": steps, "verbose": False, "optimizer": "scipy.L-BFGS-B"}
        _, noise, kernel = get_model_params(places, values, kernel=kernel, **options)
        kernels[name] = (kernel, max(float(noise), _LEAST_NOISE))
    return kernels


def sgptools(
    name: str,
    fitted: tuple[Any, float],
    places: Array,
    shape: tuple[int, int],
    limit: float,
    counts: list[int],
    steps: int,
) -> dict[str, Any]:
    """Return stops placed as inducing points: alone, and along a path within the budget."""
    import tensorflow as tf
    from sgptools.core.transformations import IPPTransform
    from sgptools.methods import get_method
    from sgptools.utils.misc import get_inducing_pts
    from sgptools.utils.tsp import run_tsp

    tf.random.set_seed(0)
    kernel, noise = fitted
    found: dict[str, Any] = {}
    for count in counts:
        begun = time.perf_counter()
        start = get_inducing_pts(places, count, seed=0)
        free = get_method("ContinuousSGP")(count, places, kernel, noise, X_candidates=places, X_init=start)
        stops = free.optimize(max_steps=steps)[0]
        found |= answer("SGP-Tools", limit, f"{name}, {count} points", cells_of(stops, shape), begun)
        begun = time.perf_counter()
        path = run_tsp(start, time_limit=1)[0][0]
        along = IPPTransform(sampling_rate=2, distance_budget=limit, constraint_weight=1000.0)
        bound = get_method("ContinuousSGP")(
            len(path), places, kernel, noise, transform=along, X_candidates=places, X_init=path
        )
        stops = bound.optimize(max_steps=steps)[0]
        found |= answer("SGP-Tools", limit, f"{name}, {count} along a path", cells_of(stops, shape), begun)
    return found


def cells_of(places: Array, shape: tuple[int, int]) -> Array:
    """Return the cells nearest to places, each once, in their order."""
    cells = np.rint(places).astype(int) @ np.array([shape[1], 1])
    return cells[np.sort(np.unique(cells, return_index=True)[1])]


def answer(planner: str, limit: float, kind: str, cells: Array, begun: float) -> dict[str, Any]:
    """Return one answer and its seconds."""
    name = f"{planner}|{limit:g}|{kind}"
    return {name: np.asarray(cells), f"{name}|seconds": time.perf_counter() - begun}


if __name__ == "__main__":
    main()
