import numpy as np
import pytest

from shared.telemetry.intervals import difference_interval, mean_interval


def test_the_interval_of_a_mean_is_that_of_the_normal_distribution() -> None:
    sample = np.random.default_rng(1).normal(500.0, 100.0, 400)

    found = mean_interval(sample.tolist(), np.random.default_rng(2))

    assert found is not None
    error = sample.std() / 20.0
    assert found.mean == pytest.approx(sample.mean())
    assert found.low == pytest.approx(sample.mean() - 1.96 * error, abs=0.15 * error)
    assert found.high == pytest.approx(sample.mean() + 1.96 * error, abs=0.15 * error)
    assert found.count == 400


def test_the_same_seed_gives_the_same_interval() -> None:
    values = [1.0, 5.0, -3.0, 8.0]

    first = mean_interval(values, np.random.default_rng(7))

    assert first == mean_interval(values, np.random.default_rng(7))


def test_no_bouts_have_no_interval() -> None:
    generator = np.random.default_rng(0)

    assert mean_interval([], generator) is None
    assert difference_interval([1.0], [], generator) is None


def test_a_difference_holds_both_sides_uncertainty() -> None:
    generator = np.random.default_rng(3)
    one, two = generator.normal(1500, 200, 300), generator.normal(0, 300, 300)

    found = difference_interval(one.tolist(), two.tolist(), generator)

    assert found is not None
    assert found.mean == pytest.approx(one.mean() - two.mean())
    width = 2 * 1.96 * np.hypot(200, 300) / np.sqrt(300)
    assert found.high - found.low == pytest.approx(width, rel=0.15)


def test_one_bout_has_an_interval_without_width() -> None:
    found = mean_interval([42.0], np.random.default_rng(0))

    assert found is not None
    assert (found.low, found.mean, found.high) == (42.0, 42.0, 42.0)
