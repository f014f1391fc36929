"""Trials of the paper's figures: random Phi of one p and theta, evaluated on validation and on test maps."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np

from sparsor.core.metrics import relative_error, squared_error
from sparsor.core.streams import stream
from sparsor.core.workers import Workers, one_blas_thread
from sparsor.design import Problem, Weights, evaluate, fixed_sparsity, lasso, unit_legs
from sparsor.design.tuning import choose_lasso_weight
from sparsor.prior.dictionary import dct_dictionary, learned_dictionary, polynomial_dictionary
from sparsor.study.protocol import SplitMaps, random_split, scaled

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from sparsor.study.scoreboard import Source
    from sparsor.study.settings import StudySettings
    from sparsor.study.store import Store

SHAPE = (32, 32)
Dictionary = Literal["learned", "dct", "polynomial"]
_DECIDING = ("seed", "rows", "lasso_maps")


class Variant(NamedTuple):
    """How the paper is read: by our defaults or as `--paper` (method.md, Algorithm 1), and its dictionary."""

    paper: bool = False
    dictionary: Dictionary = "learned"

    @property
    def name(self) -> str:
        """As titles have it."""
        return "as the paper" if self.paper else "our defaults"

    def atoms(self, settings: StudySettings) -> int:
        """Return K."""
        return settings.paper_atoms if self.paper else settings.atoms


class Draws(NamedTuple):
    """n_iter samples of Phi at one p and theta."""

    probability: float
    theta: int
    samples: int


class TrialGiven(NamedTuple):
    """What the samples of a trial are given: the problem, the split's maps, what is taken off them, the seed."""

    problem: Problem
    sets: SplitMaps
    mean: NDArray[np.float64]
    seed: int
    most_maps: int


def trial(
    source: Source,
    variant: Variant,
    number: int,
    asked: Sequence[Draws],
    settings: StudySettings,
    store: Store,
    hands: Workers,
) -> list[list[dict[str, Any]]]:
    """Return the samples of one trial, for each p and theta asked for.

    Parameters
    ----------
    source : Source
    variant : Variant
    number : int
        Of the trial: seed of the `random` split, as the paper's.
    asked : sequence of Draws
    settings : StudySettings
    store : Store
    hands : Workers

    Returns
    -------
    list of lists of dict
        Of every sample that visits two cells: `sample`, `cells`, `length`, `incoherence`, `validation` (squared error,
        E), and on the test maps `squared` and `relative`.
    """
    base = {"kind": "draws", "field": source.digest, "pixels": source.pixels, "trial": number, **variant._asdict()}
    base |= {"atoms": variant.atoms(settings), **settings.of(*_DECIDING)}
    keys = [{**base, **one._asdict()} for one in asked]
    pieces = [store.get(key) for key in keys]
    missing = [k for k, piece in enumerate(pieces) if piece is None]
    if missing:
        with one_blas_thread():  # around all threads, see `scoreboard`
            shared = hands.share(trial_given(source, variant, number, settings, store))
            for k, piece in zip(missing, hands.map(_evaluated, shared, [asked[k] for k in missing]), strict=True):
                pieces[k] = store.put(keys[k], piece)
    return [piece or [] for piece in pieces]


def winner(samples: Sequence[dict[str, Any]], weights: Weights) -> dict[str, Any]:
    """Return the sample of the lowest cost C, the first of equals: what Algorithm 1 returns with these weights."""

    def cost(one: dict[str, Any]) -> float:
        terms = weights.path * one["length"] + weights.incoherence * one["incoherence"]
        return float(weights.valid * one["validation"] + terms)

    return min(samples, key=cost)


def trial_given(source: Source, variant: Variant, number: int, settings: StudySettings, store: Store) -> TrialGiven:
    """Return what Algorithm 1 is given in a trial, and the maps that judge it."""
    sets = scaled(source.maps, random_split(source.maps, number))
    mean = np.zeros(sets.training.shape[1]) if variant.paper else sets.training.mean(axis=0)
    atoms, legs = variant.atoms(settings), unit_legs(SHAPE)
    key: dict[str, object] = {
        "kind": "dictionary",
        "field": source.digest,
        "pixels": source.pixels,
        "split": f"random, seed {number}",
    }
    key |= {"centred": not variant.paper, "atoms": atoms, "seed": settings.seed}
    with one_blas_thread():
        if variant.dictionary == "learned":
            psi = store.array(key, lambda: learned_dictionary(sets.training - mean, atoms, seed=settings.seed))
        else:
            psi = (dct_dictionary if variant.dictionary == "dct" else polynomial_dictionary)(SHAPE, atoms)
        maps = sets.validation - mean
        weight = choose_lasso_weight(psi, maps, legs, rows=settings.rows, seed=settings.seed)
    problem = Problem(psi, maps, weight, legs, settings.rows, unit_rows=not variant.paper, improve=not variant.paper)
    return TrialGiven(problem, sets, mean, settings.seed, settings.lasso_maps)


def _evaluated(given: TrialGiven, asked: Draws) -> list[dict[str, object]]:
    sparsity = fixed_sparsity(asked.probability, asked.theta)
    found: list[dict[str, object]] = []
    test = given.sets.test
    truth = _evenly(test, given.most_maps)
    with one_blas_thread():
        for sample in range(asked.samples):
            one = evaluate(given.problem, sparsity, Weights(), rng=stream(given.seed, sample), sample=sample)
            if one is None:
                continue
            decoded = from_sums(given.problem, one.phi, truth, given.mean)
            found.append(
                {
                    "sample": sample,
                    "cells": one.stops.size,
                    "length": one.length_cells,
                    "incoherence": one.incoherence,
                    "validation": one.error,
                    "squared": float(squared_error(truth, decoded).mean()),
                    "relative": float(relative_error(truth, decoded).mean()),
                }
            )
    return found


def _evenly(maps: NDArray[np.float64], most: int) -> NDArray[np.float64]:
    return np.asarray(maps[np.linspace(0, len(maps) - 1, min(most, len(maps))).round().astype(int)])


def from_sums(
    problem: Problem, phi: NDArray[np.bool_], truth: NDArray[np.float64], mean: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return maps decoded by the LASSO from the sums of Phi over them, as the paper does, (n, N)."""
    rows = phi.astype(np.float64)
    return np.asarray(lasso(rows @ problem.psi, (truth - mean) @ rows.T, problem.lasso_weight) @ problem.psi.T + mean)
