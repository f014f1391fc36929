"""The paper's figures over a field: each a table, curves, what the paper claims and what came out."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from sparsor.core.progress import Progress, silent
from sparsor.core.workers import Workers, workers_of
from sparsor.design import Weights
from sparsor.plot.curves import Panel, Series
from sparsor.study.protocol import OVERLAP_NOTE
from sparsor.study.tables import Table
from sparsor.study.trials import Draws, Variant, trial, winner

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sparsor.study.scoreboard import Source
    from sparsor.study.settings import StudySettings
    from sparsor.study.store import Store

THETA = 3
SWEEP_PROBABILITY = 0.03
LENGTH = "path length, cell units (full coverage: 1023)"
ERROR = "mean |s - s'| / |s| on test maps"


@dataclass(frozen=True)
class Figure:
    """One figure.

    Parameters
    ----------
    name : str
        Of its files.
    title : str
    table : Table
    panels : tuple of Panel
    claimed, found : str
        What the paper says, and what came out.
    numbers : dict of str to float
        What `found` states, for the claims.
    """

    name: str
    title: str
    table: Table
    panels: tuple[Panel, ...]
    claimed: str
    found: str
    numbers: dict[str, float]


def figures(
    source: Source, settings: StudySettings, store: Store, *, workers: Workers | int = 1, progress: Progress = silent
) -> list[Figure]:
    """Return the paper's figures that are made of Algorithm 1 alone, by our defaults and as the paper.

    Parameters
    ----------
    source : Source
    settings : StudySettings
    store : Store
    workers : Workers or int
    progress : Progress
    """
    hands, found = workers_of(workers), []
    for done, paper in enumerate((False, True)):
        progress("figures", done, 2)
        run = _Run(source, settings, store, hands, paper)
        found += [
            against_length(run),
            against_lambda(run, "path"),
            against_lambda(run, "incoherence"),
            dictionaries(run),
        ]
    progress("figures", 2, 2)
    return found


class _Run:
    """The trials of one reading of the paper."""

    def __init__(self, source: Source, settings: StudySettings, store: Store, hands: Workers, paper: bool) -> None:
        self.source, self.settings, self.store, self.hands, self.paper = source, settings, store, hands, paper
        self.variant = Variant(paper)
        self.suffix = "-paper" if paper else ""

    def trials(self, asked: Sequence[Draws], variant: Variant | None = None) -> list[list[list[dict[str, Any]]]]:
        """Return the samples by trial, and by what was asked for."""
        given = (self.settings, self.store, self.hands)
        return [trial(self.source, variant or self.variant, number, asked, *given) for number in self.settings.trials]

    def says(self, count: int, dictionary: str = "learned dictionary") -> tuple[str, ...]:
        atoms = self.variant.atoms(self.settings)
        setting = (
            f"{self.variant.name}: {dictionary}, at most {atoms} atoms, M = {self.settings.rows}, n_iter = {count}, "
            f"seeds of the trials {', '.join(map(str, self.settings.trials))}; {self.source.field.source}"
        )
        return (setting, OVERLAP_NOTE)


def against_length(run: _Run) -> Figure:
    """Return error against path length, with and without Enhanced Sparsification (the paper's `res11`)."""
    asked = [Draws(p, theta, run.settings.draws) for theta in (THETA, 0) for p in run.settings.probabilities]
    rows = _over_trials(run.trials(asked), asked)
    with_es, without = ([row for row in rows if row[1] == theta] for theta in (THETA, 0))
    series = (_line("with Enhanced Sparsification", with_es), _line("without", without))
    lower = _lower_at_same_length(with_es, without)
    shortest = (with_es[0][3], without[0][3])
    common = "at no path length both reach" if np.isnan(lower) else f"{lower:+.0%} error at the lengths both reach"
    return Figure(
        f"error-against-length{run.suffix}",
        f"Error against path length, {run.variant.name}",
        Table("Error against path length", _COLUMNS, tuple(rows), run.says(run.settings.draws)),
        (Panel("p = 0.03 ... 0.12", LENGTH, ERROR, series),),
        "Enhanced Sparsification: about 60 % lower error at a path length, and paths down to 200; 0.14 beyond 600",
        f"with Enhanced Sparsification {common}; shortest path {shortest[0]:.0f} with, {shortest[1]:.0f} without; "
        f"least error {min(row[5] for row in rows):.3f}",
        {"change": lower, "shortest_with": shortest[0], "shortest_without": shortest[1], "cells": with_es[0][2]},
    )


def against_lambda(run: _Run, term: str) -> Figure:
    """Return what a weight of the cost does to its term and to the error (the paper's `path1`, `err12`, `incoh3`)."""
    count = run.settings.sweep_draws
    all_samples = [one[0] for one in run.trials([Draws(SWEEP_PROBABILITY, THETA, count)])]
    name = "length" if term == "path" else "incoherence"
    rows = []
    for weight in run.settings.weights:
        won = []
        for samples in all_samples:
            unit = np.median([one["validation"] for one in samples]) / np.median([one[name] for one in samples])
            weights = Weights(1.0, **{term: float(weight * unit)})
            won.append({**winner(samples, weights), "weight": weight * unit})
        values = [np.array([one[key] for one in won]) for key in ("weight", name, "relative", "squared")]
        rows.append((weight, float(values[0].mean()), *(f(v) for v in values[1:] for f in (_mean, _sd))))
    symbol = "lambda_path" if term == "path" else "lambda_incoh"
    across = f"{symbol}, in units of median(E) / median({'L' if term == 'path' else 'mu'})"
    what = "path length, cell units" if term == "path" else "incoherence mu"
    label = f"mean and sd of {len(run.settings.trials)} trials"
    x = tuple(float(row[0]) for row in rows)

    def line(k: int) -> Series:
        return Series(label, x, *(tuple(float(row[at]) for row in rows) for at in (k, k + 1)))

    titled = ((what, what, 2), ("error", ERROR, 4))
    panels = tuple(Panel(title, across, up, (line(k),), stretched=True) for title, up, k in titled)
    columns = (f"{symbol} (units)", symbol, what, "sd", "relative", "sd", "squared", "sd")
    first, last = rows[0], rows[-1]
    claimed = {
        "path": "larger lambda_path: shorter paths, larger error",
        "incoherence": "larger lambda_incoh: lower incoherence; no significant effect on the error",
    }[term]
    return Figure(
        f"{symbol.replace('_', '-')}{run.suffix}",
        f"Effect of {symbol}, {run.variant.name}",
        Table(f"Effect of {symbol}", columns, tuple(rows), run.says(count)),
        panels,
        claimed,
        f"{what} {first[2]:.3g} at 0, {last[2]:.3g} at the largest weight; error {first[4]:.3f} and {last[4]:.3f} (p = "
        f"{SWEEP_PROBABILITY}, theta = {THETA}, {count} samples)",
        {"first": first[2], "last": last[2], "error_first": first[4], "error_last": last[4]},
    )


def dictionaries(run: _Run) -> Figure:
    """Return error against path length by dictionary (the paper's `vsdct`)."""
    asked = [Draws(p, THETA, run.settings.draws) for p in run.settings.probabilities]
    table, series, errors = [], [], {}
    for name, label in (("learned", "learned"), ("dct", "DCT-II"), ("polynomial", "polynomial (Legendre)")):
        variant = Variant(run.paper, name)  # type: ignore[arg-type]
        rows = _over_trials(run.trials(asked, variant), asked)
        series.append(_line(label, rows))
        table += [(label, *row) for row in rows]
        errors[name] = {"relative": np.mean([row[5] for row in rows]), "squared": np.mean([row[7] for row in rows])}
    numbers = {
        f"{other}_{kind}": float(errors[other][kind] / errors["learned"][kind])
        for other in ("dct", "polynomial")
        for kind in ("relative", "squared")
    }
    return Figure(
        f"dictionaries{run.suffix}",
        f"Dictionaries, {run.variant.name}",
        Table("Dictionaries", ("dictionary", *_COLUMNS), tuple(table), run.says(run.settings.draws, "each dictionary")),
        (Panel("p = 0.03 ... 0.12, theta = 3", LENGTH, ERROR, tuple(series), logarithmic=True),),
        "more than five times lower error with the learned dictionary than with DCT and polynomials",
        f"error of DCT {numbers['dct_relative']:.2f} times, of polynomials {numbers['polynomial_relative']:.2f} times "
        f"the learned dictionary's (squared: {numbers['dct_squared']:.2f} and {numbers['polynomial_squared']:.2f} "
        "times), mean over p",
        numbers,
    )


_COLUMNS = ("p", "theta", "cells", "length", "sd", "relative", "sd", "squared", "sd")


def _over_trials(trials: list[list[list[dict[str, Any]]]], asked: Sequence[Draws]) -> list[tuple[Any, ...]]:
    """Return, for each p and theta, means and sds over trials of the sample of least validation error."""
    rows = []
    for k, one in enumerate(asked):
        won = [winner(samples[k], Weights()) for samples in trials if samples[k]]
        if won:
            columns = [np.array([w[name] for w in won]) for name in ("length", "relative", "squared")]
            cells = _mean(np.array([w["cells"] for w in won]))
            rows.append((one.probability, one.theta, cells, *(f(v) for v in columns for f in (_mean, _sd))))
    return rows


def _line(label: str, rows: Sequence[tuple[Any, ...]]) -> Series:
    return Series(label, *(tuple(row[k] for row in rows) for k in (3, 5, 6)))


def _lower_at_same_length(one: Sequence[tuple[Any, ...]], other: Sequence[tuple[Any, ...]]) -> float:
    """Return the mean change of the error from the other to this one where their path lengths overlap; NaN: nowhere."""
    (x, y), (u, v) = (np.array(sorted((row[3], row[5]) for row in rows)).T for rows in (one, other))
    low, high = max(x[0], u[0]), min(x[-1], u[-1])
    if low >= high:
        return float("nan")
    at = np.linspace(low, high, 20)
    return float(np.mean(np.interp(at, x, y) / np.interp(at, u, v)) - 1)


def _mean(values: np.ndarray[Any, np.dtype[np.float64]]) -> float:
    return float(values.mean())


def _sd(values: np.ndarray[Any, np.dtype[np.float64]]) -> float:
    return float(values.std(ddof=1)) if values.size > 1 else 0.0
