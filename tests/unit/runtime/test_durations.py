"""Percentiles of the newest durations."""

import pytest

from shared.runtime.durations import EXTREME, Durations


def test_before_the_first_duration_nothing_is_said():
    assert Durations("took_ms_{}", kept=10).percentiles() == {}


def test_median_and_99th_percentile_go_by_the_pattern():
    took = Durations("took_ms_{}", kept=101)
    for value in range(101):
        took.add(float(value))
    assert took.percentiles() == pytest.approx({"took_ms_p50": 50.0, "took_ms_p99": 99.0})


def test_the_largest_is_said_where_it_is_asked_for():
    late = Durations("lateness_{}_ms", kept=10, percentiles=EXTREME)
    for value in (3.0, 1.0, 2.0):
        late.add(value)
    expected = {"lateness_p50_ms": 2.0, "lateness_p99_ms": 2.98, "lateness_max_ms": 3.0}
    assert late.percentiles() == pytest.approx(expected)


def test_only_the_newest_count():
    took = Durations("{}", kept=3, percentiles=EXTREME)
    for value in (1000.0, 900.0, 4.0, 5.0, 6.0):
        took.add(value)
    assert took.percentiles()["p50"] == pytest.approx(5.0)
    assert took.percentiles()["max"] == pytest.approx(6.0)
