"""The estimate of the round trip: RFC 6298's rules, and how many copies a link is given."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sparsor.link.roundtrip import CALM, CEILING_S, FIRST_S, FLOOR_S, MOST_COPIES, RoundTrip

SECONDS = st.none() | st.floats(0.0, 10.0)


def measured(*seconds):
    trip = RoundTrip()
    for value in seconds:
        trip.answered(value)
    return trip


def test_a_steady_link_is_waited_for_as_long_as_it_takes():
    assert RoundTrip().resend_s == FIRST_S
    assert measured(*[0.8] * 40).resend_s == pytest.approx(0.8, abs=0.01)
    assert measured(1.0).resend_s == 3.0  # RFC 6298: the first deviation is half the first round trip


def test_a_link_that_varies_is_given_more_time_than_its_mean():
    assert measured(*[0.5, 1.0] * 30).resend_s > 1.5


def test_an_answer_to_something_sent_twice_measures_nothing():
    trip = measured(0.5, 0.5)
    trip.expired()
    before_s = trip.resend_s
    trip.answered(None)
    assert trip.resend_s == before_s
    trip.answered(0.5)
    assert trip.resend_s < before_s


@given(st.lists(SECONDS | st.just(-1.0), max_size=200))
def test_it_stays_within_its_limits_whatever_happens(events):
    trip = RoundTrip()
    for value in events:
        if value == -1.0:
            trip.expired()
        else:
            trip.answered(value)
        assert FLOOR_S <= trip.resend_s <= CEILING_S
        assert 1 <= trip.copies <= MOST_COPIES


def test_copies_follow_the_losses():
    trip = measured(0.5)
    for _ in range(10):
        trip.expired()
    assert trip.copies == MOST_COPIES
    for _ in range(CALM):
        trip.answered(0.5)
    assert trip.copies == MOST_COPIES - 1
