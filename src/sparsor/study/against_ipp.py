"""Algorithm 1 against informative path planning (the paper's `comp_IPP`), and the curves of the scoreboard."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from sparsor.plot.curves import Panel, Series
from sparsor.study.figures import ERROR, LENGTH, Figure
from sparsor.study.protocol import OVERLAP_NOTE
from sparsor.study.summary import by_length
from sparsor.study.tables import Table

if TYPE_CHECKING:
    from collections.abc import Sequence

# As the paper decodes each, and Algorithm 1's flight with every reading kept.
_COMPARED = (
    ("IPP, Gaussian process at its stops", "greedy IPP", "stops", "kriging"),
    ("Algorithm 1, sums, LASSO", "Algorithm 1", "sums", "lasso"),
    ("Algorithm 1, single cells, LASSO", "Algorithm 1", "stops", "lasso"),
    ("IPP, cells under the legs, blend", "greedy IPP", "legs", "blend"),
    ("Algorithm 1, cells under the legs, blend", "Algorithm 1", "legs", "blend"),
)


def against_ipp(rows: Sequence[dict[str, Any]], source: str) -> Figure:
    """Return the figure against greedy IPP, by both protocols, without noise.

    Parameters
    ----------
    rows : sequence of dict
        Of the scoreboard.
    source : str
        Of the field.
    """
    panels, table = [], []
    numbers: dict[str, float] = {}
    for protocol in ("random", "blocked"):
        lines = {}
        for label, planner, measured, decoder in _COMPARED:
            found = by_length(rows, "relative", protocol=protocol, noise=0.0, measured=measured, decoder=decoder)
            lines[label] = found.get(planner, [])
            table += [(protocol, label, *point) for point in lines[label]]
        series = tuple(Series(label, *zip(*points, strict=True)) for label, points in lines.items() if points)
        panels.append(Panel(protocol, LENGTH, ERROR, series, logarithmic=True))
        ipp, sums, cells = (lines[one[0]] for one in _COMPARED[:3])
        numbers |= {f"{protocol}_sums": _ratio(ipp, sums), f"{protocol}_cells": _ratio(ipp, cells)}
        numbers[f"{protocol}_same_decoder"] = _ratio(lines[_COMPARED[3][0]], lines[_COMPARED[4][0]])
    words = [
        f"{protocol}: {numbers[f'{protocol}_sums']:.2f} from sums, {numbers[f'{protocol}_cells']:.2f} from single "
        f"cells, {numbers[f'{protocol}_same_decoder']:.2f} with one decoder for both"
        for protocol in ("random", "blocked")
    ]
    return Figure(
        "against-ipp",
        "Algorithm 1 against informative path planning",
        Table("Against IPP", ("protocol", "what", "length", "relative"), tuple(table), (source, OVERLAP_NOTE)),
        tuple(panels),
        "more than two times lower error than IPP at a given path length",
        f"IPP's error over Algorithm 1's at equal length; {'; '.join(words)}",
        numbers,
    )


def board_panels(rows: Sequence[dict[str, Any]], noises: Sequence[float]) -> tuple[Panel, ...]:
    """Return the panels of all error-against-length curves, `blocked`: by way of measuring and noise, the blend."""
    panels = []
    for measured, words in (("legs", "cells under the legs"), ("stops", "stops alone")):
        for noise in noises:
            found = by_length(rows, "relative", protocol="blocked", noise=noise, measured=measured, decoder="blend")
            series = [Series(planner, *zip(*points, strict=True)) for planner, points in found.items()]
            sums = by_length(rows, "relative", protocol="blocked", noise=noise, measured="sums", decoder="lasso")
            series += [Series(f"{name}, sums, LASSO", *zip(*points, strict=True)) for name, points in sums.items()]
            panels.append(Panel(f"{words}, noise {noise:g}", LENGTH, ERROR, tuple(series), logarithmic=True))
    return tuple(panels)


def _ratio(one: list[tuple[float, float]], other: list[tuple[float, float]]) -> float:
    """Return the mean ratio of two curves' errors at the path lengths of the second, where both reach; NaN: nowhere."""
    if not one or not other:
        return float("nan")
    (x, y), (u, v) = (np.array(sorted(points)).T for points in (one, other))
    inside = (u >= 0.9 * x[0]) & (u <= 1.1 * x[-1])
    return float(np.mean(np.interp(u[inside], x, y) / v[inside])) if inside.any() else float("nan")
