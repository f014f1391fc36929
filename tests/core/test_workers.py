"""Whoever works, and however many they are: the same results in the same order."""

from __future__ import annotations

from operator import add

import pytest

from sparsor.core.workers import Threads, workers_of


@pytest.mark.parametrize("count", [1, 3])
def test_results_come_in_the_order_of_the_parts(count):
    hands = Threads(count)
    assert list(hands.map(add, hands.share(100), range(50))) == list(range(100, 150))
    assert hands.call(add, hands.share(1), 2) == 3


def test_parts_are_taken_when_there_is_room_for_them():
    hands, taken = Threads(2), []
    results = hands.map(add, hands.share(0), (taken.append(part) or part for part in range(1000)))
    assert next(results) == 0
    assert len(taken) < 10
    results.close()


def test_the_error_of_a_part_is_raised_where_the_results_are_read():
    hands = Threads(2)
    with pytest.raises(TypeError):
        list(hands.map(add, hands.share(1), [1, "one", 1]))


def test_workers_are_a_number_of_threads_or_themselves():
    hands = Threads(3)
    assert workers_of(hands) is hands
    assert workers_of(2).count == 2
    assert workers_of(None).count >= 1
