"""The claims of the paper's abstract, one by one: under which definition each is true."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple

from sparsor.study.protocol import OVERLAP_NOTE
from sparsor.study.summary import by_length
from sparsor.study.tables import Table

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from sparsor.study.figures import Figure

_TRAVEL = "travel below 10 % of a full-coverage path"
_SHORT = 2  # of the path lengths on the scoreboard
COVERAGE = 1023.0
CELLS = 1024.0


class Checked(NamedTuple):
    """One reading of a claim: what it says, by which definition, the value, and whether it holds."""

    claim: str
    definition: str
    value: str
    holds: str


def claims(figures: Mapping[str, Figure], rows: Sequence[dict[str, Any]]) -> Table:
    """Return the claims checked.

    Parameters
    ----------
    figures : mapping of str to Figure
        By name.
    rows : sequence of dict
        Of the scoreboard.
    """
    ipp = figures["against-ipp"]
    checked = [
        *_travel(figures),
        *_within_budget(rows),
        *_dictionaries(figures),
        *_ipp(ipp),
        *_sparser(figures),
        *_offline(),
    ]
    return Table("The abstract's claims", Checked._fields, tuple(map(tuple, checked)), (OVERLAP_NOTE,))


def _travel(figures: Mapping[str, Figure]) -> list[Checked]:
    found = []
    for suffix, words in _READINGS:
        numbers = figures[f"error-against-length{suffix}"].numbers
        length, cells = numbers["shortest_with"] / COVERAGE, numbers["cells"] / CELLS
        where = f"p = 0.03, theta = 3, {words}"
        found += [
            Checked(_TRAVEL, f"path length over 1023 cell units, {where}", f"{length:.1%}", _yes(length < 0.1)),
            Checked(_TRAVEL, f"cells visited over 1024, {where}", f"{cells:.1%}", _yes(cells < 0.1)),
        ]
    return found


def _within_budget(rows: Sequence[dict[str, Any]]) -> list[Checked]:
    found = []
    for measured, decoder, words in (
        ("sums", "lasso", "from its sums"),
        ("legs", "blend", "cells under the legs, blend"),
    ):
        lines = by_length(rows, "relative", protocol="blocked", noise=0.0, measured=measured, decoder=decoder)
        for length, error in lines.get("Algorithm 1", [])[:_SHORT]:
            share = length / COVERAGE
            value = f"{share:.1%}, |s - s'| / |s| = {error:.3f}"
            where = f"path length, p and theta searched within a budget, blocked, {words}"
            found.append(Checked(_TRAVEL, where, value, f"{_yes(share < 0.1)}, at this error"))
    return found


def _dictionaries(figures: Mapping[str, Figure]) -> list[Checked]:
    found = []
    for suffix, words in _READINGS:
        for other, name in (("dct", "DCT"), ("polynomial", "polynomial")):
            for kind, error in (("relative", "|s - s'| / |s|"), ("squared", "|s - s'|^2")):
                ratio = figures[f"dictionaries{suffix}"].numbers[f"{other}_{kind}"]
                claim = f"five times lower error than with a {name} dictionary"
                definition = f"ratio of mean {error} over p = 0.03 ... 0.12, {words}"
                found.append(Checked(claim, definition, f"{ratio:.2f} times", _yes(ratio >= 5)))
    return found


def _ipp(figure: Figure) -> list[Checked]:
    ways = {
        "sums": "Algorithm 1 from its sums by the LASSO, IPP by its Gaussian process",
        "cells": "Algorithm 1 from single cells by the LASSO, IPP by its Gaussian process",
        "same_decoder": "both from the cells under their legs by the blend",
    }
    claim = "two times lower error than IPP at a path length"
    found = []
    for protocol in ("random", "blocked"):
        for way, words in ways.items():
            ratio = figure.numbers[f"{protocol}_{way}"]
            found.append(Checked(claim, f"{protocol}; {words}", f"{ratio:.2f} times", _yes(ratio >= 2)))
    return found


def _sparser(figures: Mapping[str, Figure]) -> list[Checked]:
    found = []
    for suffix, words in _READINGS:
        change = figures[f"error-against-length{suffix}"].numbers["change"]
        claim = "60 % lower error with Enhanced Sparsification at a path length"
        definition = f"mean |s - s'| / |s| where the path lengths overlap, {words}"
        value = (
            "the lengths do not overlap"
            if math.isnan(change)
            else f"{abs(change):.0%} {'lower' if change < 0 else 'higher'}"
        )
        found.append(Checked(claim, definition, value, _yes(-change >= 0.6)))
    return found


def _offline() -> list[Checked]:
    claim = "no online optimisation, as against IPP"
    return [
        Checked(claim, "the route is fixed before the flight: Algorithm 1, refined search", "by construction", "yes"),
        Checked(
            claim,
            "IPP by a Gaussian process whose kernel is fixed beforehand: the gain does not depend on the values read; "
            "so it too is planned before the flight (see the seconds to plan)",
            "by construction",
            "no difference",
        ),
    ]


_READINGS = (("", "our defaults"), ("-paper", "as the paper"))


def _yes(holds: bool) -> str:
    return "yes" if holds else "no"
