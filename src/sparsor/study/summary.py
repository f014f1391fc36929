"""The scoreboard's rows put together over the splits of a protocol."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from sparsor.study.protocol import OVERLAP_NOTE
from sparsor.study.tables import Table

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

_GROUP = ("protocol", "planner", "share", "noise", "measured", "decoder")
ERRORS = ("squared", "relative", "centred", "rmse")
DEFINITIONS = (
    "squared: |s - s'|^2 a map on the 0..1 scale of the training windows; relative: |s - s'| / |s| there; centred: "
    "|s - s'| / |s - mean(s)|; means over the test maps of each split, then over splits. length: of the open path, "
    "cell units; full coverage is 1023. noise: sd of a reading on the 0..1 scale. legs: every cell under the route is "
    "measured; stops: its turning points alone; sums: the M sums of Phi over them"
)


def all_rows(rows: Sequence[dict[str, Any]], unit: str) -> Table:
    """Return every row as it came, but for the seconds, which no two runs share."""
    columns = ("protocol", "split", *_GROUP[1:], "length", "maps", *ERRORS)
    return Table("Scoreboard, every split", _with_unit(columns, unit), _picked(rows, columns), _notes(rows))


def means(rows: Sequence[dict[str, Any]], unit: str) -> Table:
    """Return the means over the splits, and the spread of the relative error over them."""
    groups: dict[tuple[object, ...], list[dict[str, Any]]] = {}
    for row in rows:
        groups.setdefault(tuple(row[name] for name in _GROUP), []).append(row)
    found = []
    for key, group in groups.items():
        values = {name: np.array([row[name] for row in group]) for name in (*ERRORS, "length")}
        spread = float(values["relative"].std(ddof=1)) if len(group) > 1 else None
        found.append((*key, len(group), *(float(values[name].mean()) for name in ("length", *ERRORS)), spread))
    columns = (*_GROUP, "splits", "length", *ERRORS, "sd of relative over splits")
    return Table("Scoreboard, means over splits", _with_unit(columns, unit), tuple(found), (DEFINITIONS, *_notes(rows)))


def seconds(rows: Sequence[dict[str, Any]]) -> Table:
    """Return the mean time to plan, by planner and length; of the machine that ran it."""
    shares = sorted({row["share"] for row in rows})
    planners = dict.fromkeys(row["planner"] for row in rows)
    found = []
    for planner in planners:
        of = {s: [row["seconds"] for row in rows if row["planner"] == planner and row["share"] == s] for s in shares}
        found.append((planner, *(float(np.mean(of[s])) if of[s] else None for s in shares)))
    return Table("Seconds to plan", ("planner", *(f"{s:.0%}" for s in shares)), tuple(found))


def by_length(
    rows: Iterable[dict[str, Any]], error: str, *, protocol: str, noise: float, measured: str, decoder: str
) -> dict[str, list[tuple[float, float]]]:
    """Return, by planner, mean path length and mean error at each share, the shortest first."""
    found: dict[str, dict[float, list[tuple[float, float]]]] = {}
    asked = (protocol, noise, measured, decoder)
    for row in rows:
        if (row["protocol"], row["noise"], row["measured"], row["decoder"]) == asked:
            found.setdefault(row["planner"], {}).setdefault(row["share"], []).append((row["length"], row[error]))
    return {
        planner: [(float(length), float(value)) for length, value in (np.mean(of[s], axis=0) for s in sorted(of))]
        for planner, of in found.items()
    }


def headline(rows: Sequence[dict[str, Any]], error: str, *, protocol: str, noise: float) -> Table:
    """Return one error by planner, way of measuring and decoder against the share of full coverage."""
    chosen = [row for row in rows if row["protocol"] == protocol and row["noise"] == noise]
    shares = sorted({row["share"] for row in chosen})
    found = []
    for key in dict.fromkeys((row["planner"], row["measured"], row["decoder"]) for row in chosen):
        of = [row for row in chosen if (row["planner"], row["measured"], row["decoder"]) == key]
        values = [[row[error] for row in of if row["share"] == share] for share in shares]
        found.append((*key, *(float(np.mean(one)) if one else None for one in values)))
    title = f"{protocol}, noise {noise:g}: {error} error"
    columns = ("planner", "measured", "decoder", *(f"{share:.0%}" for share in shares))
    return Table(title, columns, tuple(found), _notes(chosen))


def _picked(rows: Sequence[dict[str, Any]], columns: Sequence[str]) -> tuple[tuple[object, ...], ...]:
    return tuple(tuple(row[name] for name in columns) for row in rows)


def _with_unit(columns: Sequence[str], unit: str) -> tuple[str, ...]:
    return tuple(f"rmse ({unit or 'unit unknown'})" if name == "rmse" else name for name in columns)


def _notes(rows: Sequence[dict[str, Any]]) -> tuple[str, ...]:
    return (OVERLAP_NOTE,) if any(row["protocol"] == "random" for row in rows) else ()
