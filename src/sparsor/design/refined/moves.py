"""Random changes of a route: what simulated annealing may try."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sparsor.core.compiled import njit

if TYPE_CHECKING:
    from numpy.typing import NDArray

_REACHES = np.array([1.0, 1.0, 2.0, 4.0])  # cells, standard deviation of a new place around an old one


@njit(cache=True, nogil=True)
def propose(
    stops: NDArray[np.int64], open_cells: NDArray[np.bool_], columns: int, dwell: bool, rng: np.random.Generator
) -> NDArray[np.int64]:
    """Return a changed copy of a route.

    One to three of: move a stop, move two neighbours alike, insert a stop beside a leg or beyond an end, delete one,
    give it another place in the order, and turn a stretch round; where a route may dwell, also give a stop once more.
    Budgets are mostly used up, so an insertion alone rarely fits, but together with what frees its length it does.

    Parameters
    ----------
    stops : array of int64 (n,)
    open_cells : array of bool (N,)
        Where a stop may lie.
    columns : int
    dwell : bool
        Whether a stop may follow itself.
    rng : numpy.random.Generator
    """
    trial = stops
    for _ in range(1 + int(rng.integers(0, 2)) + int(rng.integers(0, 2))):
        kind = int(rng.integers(0, 10))
        reach = _REACHES[rng.integers(0, _REACHES.size)]
        at = int(rng.integers(0, trial.size))
        if kind < 4:
            trial = _moved(trial, at, 2 if kind == 3 else 1, reach, open_cells, columns, rng)
        elif kind < 6:
            if dwell and kind == 4:
                trial = np.concatenate((trial[: at + 1], trial[at:]))
            else:
                trial = _inserted(trial, reach, open_cells, columns, rng)
        elif kind < 8 and trial.size > 2:
            trial = np.concatenate((trial[:at], trial[at + 1 :]))
        elif kind == 8:
            trial = _turned(trial, at, int(rng.integers(0, trial.size)))
        elif trial.size > 2:
            trial = _displaced(trial, at, int(rng.integers(0, trial.size)))
    return trial


@njit(cache=True, nogil=True)
def _moved(
    stops: NDArray[np.int64],
    at: int,
    count: int,
    reach: float,
    open_cells: NDArray[np.bool_],
    columns: int,
    rng: np.random.Generator,
) -> NDArray[np.int64]:
    """Move one stop, or several in a row alike, to a place nearby; none when that is not on open cells."""
    down, across = int(np.rint(reach * rng.normal())), int(np.rint(reach * rng.normal()))
    trial = stops.copy()
    for k in range(at, min(at + count, stops.size)):
        cell = _place(stops[k] // columns + down, stops[k] % columns + across, open_cells, columns)
        if cell < 0:
            return stops
        trial[k] = cell
    return trial


@njit(cache=True, nogil=True)
def _inserted(
    stops: NDArray[np.int64], reach: float, open_cells: NDArray[np.bool_], columns: int, rng: np.random.Generator
) -> NDArray[np.int64]:
    """Insert a stop near a point of a leg, or near an end."""
    at = int(rng.integers(0, stops.size + 1))  # in front of this position
    before, after = stops[max(at - 1, 0)], stops[min(at, stops.size - 1)]
    along = rng.random()
    row = (1 - along) * (before // columns) + along * (after // columns) + reach * rng.normal()
    column = (1 - along) * (before % columns) + along * (after % columns) + reach * rng.normal()
    cell = _place(int(np.rint(row)), int(np.rint(column)), open_cells, columns)
    if cell < 0 or cell in (before, after):
        return stops
    return np.concatenate((stops[:at], np.array([cell]), stops[at:]))


@njit(cache=True, nogil=True)
def _place(row: int, column: int, open_cells: NDArray[np.bool_], columns: int) -> int:
    """Return the cell, or -1 when it is outside."""
    if row < 0 or column < 0 or column >= columns or row * columns + column >= open_cells.size:
        return -1
    cell = row * columns + column
    return cell if open_cells[cell] else -1


@njit(cache=True, nogil=True)
def _turned(stops: NDArray[np.int64], one: int, other: int) -> NDArray[np.int64]:
    """Turn the stretch between two positions round."""
    first, last = min(one, other), max(one, other) + 1
    trial = stops.copy()
    trial[first:last] = stops[first:last][::-1]
    return trial


@njit(cache=True, nogil=True)
def _displaced(stops: NDArray[np.int64], at: int, to: int) -> NDArray[np.int64]:
    """Give a stop another position in the order."""
    rest = np.concatenate((stops[:at], stops[at + 1 :]))
    return np.concatenate((rest[:to], stops[at : at + 1], rest[to:]))
