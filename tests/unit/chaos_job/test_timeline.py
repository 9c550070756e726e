"""When a rate is full again."""

import pytest

from services.jobs.chaos.timeline import Timeline


def steady(timeline: Timeline, begin: float, end: float, rate: float) -> None:
    """Ten additions a second."""
    count = round((end - begin) * 10)
    for index in range(1, count + 1):
        timeline.add(begin + index / 10, round(rate / 10))


@pytest.fixture
def timeline() -> Timeline:
    made = Timeline()
    steady(made, 0.0, 10.0, 1000)
    made.note_calm(0.0, 10.0)
    return made


def test_the_base_is_the_median_of_calm_windows(timeline: Timeline):
    assert timeline.base == pytest.approx(1000, rel=0.06)


def test_a_rate_that_never_fell_is_full_at_once(timeline: Timeline):
    steady(timeline, 10.0, 15.0, 1000)
    assert timeline.full_from(10.0, 15.0) == 10.0


def test_a_gap_is_waited_for(timeline: Timeline):
    steady(timeline, 13.0, 20.0, 1000)
    found = timeline.full_from(10.0, 20.0)
    assert found is not None
    assert 12.5 <= found <= 13.0


def test_a_window_must_have_ended(timeline: Timeline):
    steady(timeline, 10.0, 11.9, 1000)
    assert timeline.full_from(10.0, 11.9) is None


def test_half_the_rate_is_not_full(timeline: Timeline):
    steady(timeline, 10.0, 30.0, 500)
    assert timeline.full_from(10.0, 30.0) is None


def test_nothing_calm_is_no_base():
    assert Timeline().base == 0.0
