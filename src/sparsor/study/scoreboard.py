"""The scoreboard: every planner, decoder and way of measuring, at equal path lengths, by both protocols."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from sparsor.core.metrics import centred_relative_error, relative_error, rmse, squared_error
from sparsor.core.progress import Progress, silent
from sparsor.core.streams import stream
from sparsor.core.workers import Workers, one_blas_thread, workers_of
from sparsor.design import Budget, Problem, unit_legs
from sparsor.design.refined import refine
from sparsor.design.tuning import choose_lasso_weight
from sparsor.errors import BudgetError
from sparsor.study.baselines import best_within, lawnmower, qr_pivot_tour, random_tour, tuned_ipp
from sparsor.study.cases import Case, blocked_case, random_case
from sparsor.study.decoding import LINEAR, decode_lasso, decode_linear
from sparsor.study.observing import Readings, of_cells, readings, task_of
from sparsor.study.peers import PeerRoute, Peers, best_kind, peer_routes

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from numpy.typing import NDArray

    from sparsor.design import LegTable
    from sparsor.prior.field import Field
    from sparsor.prior.windows import MapSet
    from sparsor.study.settings import StudySettings
    from sparsor.study.store import Store

PLANNERS = ("lawnmower", "random cells", "QR pivots", "greedy IPP", "Algorithm 1", "refined")
_DEAF = frozenset(PLANNERS) - {"refined"}  # to the noise; of others' planners the validation maps choose a kind by it
_DECIDING = ("noises", "seed", "moves", "samples", "atoms", "rows", "lasso_maps")
_RANDOM = 11  # the stream of random cells


@dataclass(frozen=True)
class Source:
    """A field as the study takes it.

    Parameters
    ----------
    field : Field
    maps : MapSet
        Its windows, by the protocol.
    pixels : tuple of int, optional
        What it was resampled to.
    digest : str
        Of the field, see `field_hash`.
    """

    field: Field
    maps: MapSet
    pixels: tuple[int, int] | None
    digest: str


class Given(NamedTuple):
    """What all pieces of one split are given.

    Its case, Algorithm 1's problem without a budget, the settings, and the routes of others' planners by planner and
    share of full coverage.
    """

    case: Case
    problem: Problem
    settings: StudySettings
    peers: dict[tuple[str, float], list[PeerRoute]] = {}  # noqa: RUF012 # a tuple's default; nobody changes it


class _Part(NamedTuple):
    planner: str
    share: float


class _Flown(NamedTuple):
    stops: NDArray[np.int64]
    seconds: float
    phi: NDArray[np.bool_] | None = None


def scoreboard(
    source: Source,
    settings: StudySettings,
    store: Store,
    *,
    peers: Peers | None = None,
    workers: Workers | int = 1,
    progress: Progress = silent,
) -> list[dict[str, Any]]:
    """Return the rows of the scoreboard, one a split, planner, length, noise, way of measuring and decoder.

    Parameters
    ----------
    source : Source
    settings : StudySettings
    store : Store
        Pieces that are there are not made again.
    peers : Peers, optional
        Planners by others, which run too.
    workers : Workers or int
    progress : Progress

    Returns
    -------
    list of dict
        With `protocol`, `split`, `planner`, `share`, `length`, `noise`, `measured`, `decoder`, `maps`, the errors
        `squared`, `relative`, `centred` and `rmse` (the field's unit), and the `seconds` to plan.
    """
    hands, rows = workers_of(workers), []
    splits = [("blocked", fold) for fold in settings.folds] + [("random", seed) for seed in settings.seeds]
    for done, (protocol, number) in enumerate(splits):
        progress("scoreboard", done, len(splits))
        planners = (*PLANNERS, *(peers.planners if peers else ()))
        parts = [_Part(planner, share) for planner in planners for share in settings.shares]
        keys = [_key(source, settings, protocol, number, part, peers) for part in parts]
        pieces = [store.get(key) for key in keys]
        missing = [k for k, piece in enumerate(pieces) if piece is None]
        if missing:
            # Around all threads: one that left it alone would give the others back their many threads of BLAS.
            with one_blas_thread():
                given = split_given(source, protocol, number, settings, store)
                if peers and any(parts[k].planner in peers.planners for k in missing):
                    given = given._replace(peers=_peers(given, peers))
                shared = hands.share(given)
                made = hands.map(_piece, shared, [parts[k] for k in missing])
                for k, piece in zip(missing, made, strict=True):
                    pieces[k] = store.put(keys[k], piece)
        rows += [{"protocol": protocol, "split": number, **row} for piece in pieces for row in piece or ()]
    progress("scoreboard", len(splits), len(splits))
    return rows


def _key(
    source: Source, settings: StudySettings, protocol: str, number: int, part: _Part, peers: Peers | None
) -> dict[str, object]:
    split = {"field": source.digest, "pixels": source.pixels, "protocol": protocol, "number": number}
    key = {"kind": "scoreboard", **split, **part._asdict(), **settings.of(*_DECIDING)}
    if peers and part.planner in peers.planners:
        key |= {"peers": peers.versions, "steps": peers.steps}
    return key


def _peers(given: Given, peers: Peers) -> dict[tuple[str, float], list[PeerRoute]]:
    """Return the routes of others' planners, by planner and share of full coverage."""
    legs = given.problem.legs
    share_of = {share * (legs.size - 1): share for share in given.settings.shares}
    budgets = [Budget(limit, "distance") for limit in share_of]
    found = peer_routes(peers, given.case.sets.training, legs, budgets)
    return {(planner, share_of[limit]): routes for (planner, limit), routes in found.items()}


def _case(source: Source, protocol: str, number: int) -> Case:
    with one_blas_thread():
        if protocol == "random":
            return random_case(source.maps, number)
        return blocked_case(source.maps, source.field, number, source.pixels)


def split_given(source: Source, protocol: str, number: int, settings: StudySettings, store: Store) -> Given:
    """Return what the pieces of one split are given."""
    case = _case(source, protocol, number)
    legs = unit_legs(case.shape)
    key: dict[str, object] = {"kind": "dictionary", "field": source.digest, "pixels": source.pixels}
    key |= {"split": case.name, "centred": True, **settings.of("atoms", "seed")}
    with one_blas_thread():
        psi = store.array(key, lambda: case.dictionary(settings.atoms, settings.seed))
        maps = case.sets.validation - case.mean
        weight = choose_lasso_weight(psi, maps, legs, rows=settings.rows, seed=settings.seed)
    return Given(case, Problem(psi, maps, weight, legs, settings.rows), settings)


def _piece(given: Given, part: _Part) -> list[dict[str, object]]:
    """Return the rows of one planner at one length."""
    limit = part.share * (given.problem.legs.size - 1)
    head = {"planner": part.planner, "share": part.share}
    rows: list[dict[str, object]] = []
    flown: _Flown | None = None
    with one_blas_thread():
        for sd in given.settings.noises:
            if flown is None or part.planner not in _DEAF:
                try:
                    flown = _flown(given, part, limit, sd)
                except BudgetError:
                    return []
            length = given.problem.legs.path_length(flown.stops)
            known = {**head, "length": length, "noise": sd, "seconds": flown.seconds}
            rows += [{**known, **row} for row in _decoded(given, flown, sd)]
    return rows


def _flown(given: Given, part: _Part, limit: float, sd: float) -> _Flown:
    begun, planner = time.perf_counter(), part.planner
    case, legs, settings = given.case, given.problem.legs, given.settings
    if planner not in PLANNERS:
        routes = given.peers.get((planner, part.share))
        if not routes:
            raise BudgetError(f"{planner} has no route of its own within {limit:g} cell units")
        return _Flown(*best_kind(routes, case, legs, "legs", sd=sd, t90_s=0.0, by=squared_error))
    budget = Budget(limit, "distance")
    if planner == "Algorithm 1":
        problem = replace(given.problem, budget=budget)
        best = best_within(problem, seed=settings.seed, iterations=settings.samples)
        return _Flown(best.stops, time.perf_counter() - begun, best.phi)
    if planner == "refined":
        stops = refine(task_of(case, legs, limit, sd=sd), seed=settings.seed, iterations=settings.moves).stops
    else:
        stops = _BASELINES[planner](case, legs, budget, settings.seed)
    return _Flown(stops, time.perf_counter() - begun)


_BASELINES: dict[str, Callable[[Case, LegTable, Budget, int], NDArray[np.int64]]] = {
    "lawnmower": lambda _case, legs, budget, _seed: lawnmower(legs, budget),
    "random cells": lambda _case, legs, budget, seed: random_tour(legs, budget, stream(seed, _RANDOM)),
    "QR pivots": lambda case, legs, budget, _seed: qr_pivot_tour(case.sets.training, legs, budget),
    "greedy IPP": lambda case, legs, budget, _seed: tuned_ipp(case.sets.validation, legs, budget)[0],
}


def _decoded(given: Given, flown: _Flown, sd: float) -> Iterator[dict[str, object]]:
    """Yield the errors of one flight by each way of measuring and decoder."""
    case, legs, psi = given.case, given.problem.legs, given.problem.psi
    few = _fewer(case, given.settings.lasso_maps)
    for measured in ("legs", "stops"):
        made = readings(legs, flown.stops, measured, sd=sd)
        for decoder in LINEAR:
            yield _errors(case, measured, decoder, decode_linear(case, made, decoder))
        yield _errors(few, measured, "lasso", decode_lasso(few, made, psi))
    if flown.phi is not None:
        made, phi = _summed(flown.phi, flown.stops, legs.size, sd)
        yield _errors(few, "sums", "lasso", decode_lasso(few, made, psi, sums=phi))


def _summed(
    phi: NDArray[np.bool_], stops: NDArray[np.int64], size: int, sd: float
) -> tuple[Readings, NDArray[np.bool_]]:
    cells = np.unique(stops)
    return of_cells(cells, size, sd), phi[:, cells]


def _fewer(case: Case, most: int) -> Case:
    """Return a case with as many of its test maps, evenly chosen."""
    test = case.sets.test
    kept = np.linspace(0, len(test) - 1, min(most, len(test))).round().astype(int)
    return replace(case, sets=replace(case.sets, test=test[kept]))


def _errors(case: Case, measured: str, decoder: str, decoded: NDArray[np.float64]) -> dict[str, object]:
    truth, (low, high) = case.sets.test, case.sets.scale
    return {
        "measured": measured,
        "decoder": decoder,
        "maps": len(truth),
        "squared": float(squared_error(truth, decoded).mean()),
        "relative": float(relative_error(truth, decoded).mean()),
        "centred": float(np.nanmean(centred_relative_error(truth, decoded))),
        "rmse": rmse(truth, decoded) * (high - low),
    }
