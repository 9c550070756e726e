"""Counts a second over a sliding stretch."""

import pytest

from shared.clock import ManualClock
from shared.runtime.rate import Rate


def test_nothing_counted_is_no_rate_even_at_the_first_instant():
    clock = ManualClock(5.0)
    rate = Rate(clock)
    assert rate.per_second() == 0.0
    rate.add(10)
    assert rate.per_second() == 0.0


def test_the_rate_is_over_the_time_since_the_start_until_the_stretch_is_full():
    clock = ManualClock(5.0)
    rate = Rate(clock, seconds=4.0)
    rate.add(10)
    clock.advance(2.0)
    rate.add(10)
    assert rate.per_second() == pytest.approx(10.0)


def test_what_is_older_than_the_stretch_is_forgotten():
    clock = ManualClock()
    rate = Rate(clock, seconds=4.0)
    rate.add(1000)
    clock.advance(5.0)
    rate.add(8)
    assert rate.per_second() == pytest.approx(2.0)
    clock.advance(5.0)
    assert rate.per_second() == 0.0
