"""Arrows, numbers: where they go on the map."""

from __future__ import annotations

import numpy as np
import pytest

from sparsor.plot.route import ARROW_EVERY_IN, ASIDE_IN, NUMBER_IN, _aside, arrows, numbered_stops


def test_arrows_point_along_the_route() -> None:
    square = np.array([[0.0, 0.0], [0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]])
    places, angles = zip(*arrows(square), strict=True)
    np.testing.assert_allclose(angles, [0, 90, 180, -90], atol=1e-9)
    np.testing.assert_allclose(places, [[0, 0.5], [0.5, 1], [1, 0.5], [0.5, 0]])


def test_arrows_keep_their_distance_along_a_route_of_short_legs() -> None:
    path = np.column_stack((np.arange(100) * 0.12, np.zeros(100)))
    places = np.array([place[0] for place, _ in arrows(path)])
    assert np.all(np.diff(places) >= ARROW_EVERY_IN - 1e-9)
    assert len(places) > 100 * 0.12 / ARROW_EVERY_IN / 2
    assert arrows(np.zeros((1, 2))) == []
    assert arrows(np.zeros((5, 2))) == []


def test_home_stands_beside_its_stop_inside_the_fence_and_off_the_lines() -> None:
    place = np.array([1.0, 1.0])
    to_the_north, to_the_west = np.array([[1.0, 1.0], [1.0, 3.0]]), np.array([[1.0, 1.0], [-2.0, 1.0]])
    fence = np.array([[-3.0, 0.95], [1.5, 0.95], [1.5, 4.0], [-3.0, 4.0]])
    aside = _aside(place, [to_the_north, to_the_west], fence)
    np.testing.assert_allclose(aside - place, [ASIDE_IN, 0.0], atol=1e-12)
    nowhere = np.array([[5.0, 5.0], [6.0, 5.0], [6.0, 6.0]])
    assert np.hypot(*(_aside(place, [to_the_north], nowhere) - place)) == pytest.approx(ASIDE_IN)


def row(count: int, apart_in: float) -> np.ndarray:
    return np.column_stack((np.arange(count) * apart_in, np.zeros(count)))


def test_all_stops_are_numbered_up_to_thirty() -> None:
    assert numbered_stops(row(30, 0.2)) == list(range(30))


@pytest.mark.parametrize(("count", "every"), [(31, 5), (102, 5), (300, 10)])
def test_of_more_stops_some_are_numbered(count: int, every: int) -> None:
    numbered = numbered_stops(row(count, 0.2))
    assert numbered[0] == 0
    assert numbered[-1] == count - 1
    assert all((index + 1) % every == 0 for index in numbered[1:-1])
    assert len(numbered) >= count // every


@pytest.mark.parametrize("count", [1, 2, 25, 120])
def test_numbers_do_not_lie_on_each_other(count: int) -> None:
    stops = np.random.default_rng(0).random((count, 2))
    kept = stops[numbered_stops(stops)]
    apart = np.hypot(*(kept[:, None] - kept[None]).transpose(2, 0, 1))
    assert np.all(apart[~np.eye(len(kept), dtype=bool)] >= NUMBER_IN)
    assert numbered_stops(stops)[0] == 0
