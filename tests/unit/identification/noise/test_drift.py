"""How noise grows where nothing holds the arm."""

import numpy as np
import pytest

from shared.identification.dataset.types import Float64
from shared.identification.noise.drift import Drift, drift_of

_BLOCKS, _FINE = 15, 20


def _parts(rng: np.random.Generator, count: int, lasting: float, slowing: float = 0.08) -> Float64:
    """Return float64[count, B, 1]: a mass that slows down, pushed at random, from a wrong speed."""
    kept = np.exp(-1.0 / (_FINE * lasting)) if lasting else 0.0
    speed, place, push = 0.3 * rng.standard_normal(count), np.zeros(count), np.zeros(count)
    found = np.empty((count, _BLOCKS, _FINE))
    for block in range(_BLOCKS):
        for instant in range(_FINE):
            fresh = rng.standard_normal(count)
            push = kept * push + np.sqrt(1.0 - kept**2) * fresh
            size = 0.2 / _FINE if lasting else 0.2 / np.sqrt(_FINE)
            speed = speed * (1.0 - slowing / _FINE) + size * push
            place = place + speed / _FINE
            found[:, block, instant] = place
    means = found.mean(axis=2) + 0.05 * rng.standard_normal((count, _BLOCKS))
    return means[..., None]


def _news(drift: Drift, parts: Float64) -> Float64:
    return np.stack([drift.news(each)[:, 0] for each in parts])


@pytest.mark.parametrize("lasting", [0.0, 1.5, 6.0])
def test_what_is_new_in_each_block_is_white(lasting: float):
    rng = np.random.default_rng(0)
    drift = drift_of(list(_parts(rng, 200, lasting)), 1.0, np.zeros(1))
    assert drift is not None
    fresh = _parts(rng, 400, lasting)
    assert np.mean(fresh[:, -1] ** 2) > 50.0 * np.mean(fresh[:, 0] ** 2)
    news = _news(drift, fresh)
    power = np.mean(news**2, axis=0)
    assert power == pytest.approx(np.ones(_BLOCKS), abs=0.45)
    assert np.mean(news[:, 1:] * news[:, :-1]) == pytest.approx(0.0, abs=0.08)


def test_a_part_in_which_something_happened_makes_no_noise_of_it():
    rng = np.random.default_rng(1)
    parts = _parts(rng, 100, 0.0)
    usual = drift_of(list(parts), 1.0, np.zeros(1))
    parts[7] *= 30.0
    told = drift_of(list(parts), 1.0, np.zeros(1))
    assert usual is not None
    assert told is not None
    assert told.spread(_BLOCKS) == pytest.approx(usual.spread(_BLOCKS), rel=0.25)


def test_parts_may_begin_further_off_than_repeats_say_but_no_nearer():
    rng = np.random.default_rng(3)
    drift = drift_of(list(_parts(rng, 60, 0.0)), 1.0, np.zeros(1))
    assert drift is not None
    same = drift.begun_as(np.zeros(1), np.zeros(1))
    assert same.spread(_BLOCKS) == pytest.approx(drift.spread(_BLOCKS))
    further = drift.begun_as(np.zeros(1), np.array([3.0]))
    slowing, at = float(drift.slowing[0]), np.arange(_BLOCKS) + 0.5
    assert slowing > 0.0
    way = -np.expm1(-slowing * at) / slowing
    steady, pushed = (3.0 * each[None, :, None] for each in (way, 0.1 * at**2))
    wrong, right = (float(np.mean(_news(each, steady) ** 2)) for each in (drift, further))
    assert wrong > 4.0
    assert right < 0.3
    assert np.mean(_news(further, pushed) ** 2) > 2.0  # no first speed makes up for that


def test_in_larger_noise_floors_noise_is_smaller_and_what_is_new_as_large():
    rng = np.random.default_rng(2)
    parts = _parts(rng, 60, 0.0)
    drift = drift_of(list(parts), 1.0, np.zeros(1))
    assert drift is not None
    larger = drift.scaled(np.array([4.0]))
    assert larger.spread(5) == pytest.approx(drift.spread(5) / 4.0)
    assert larger.news(parts[0] / 4.0) == pytest.approx(drift.news(parts[0]))
    both = drift.beside(larger)
    two = both.news(np.concatenate([parts[0], parts[0] / 4.0], axis=1))
    assert two[:, 0] == pytest.approx(two[:, 1])


def test_a_few_parts_say_nothing_and_steps_of_a_reading_are_noise():
    rng = np.random.default_rng(3)
    assert drift_of(list(_parts(rng, 5, 0.0)), 1.0, np.zeros(1)) is None
    assert drift_of([], 1.0, np.zeros(1)) is None
    still = drift_of([1e-6 * each for each in _parts(rng, 20, 0.0)], 1.0, np.full(1, 1e-5))
    assert still is not None
    assert still.spread(_BLOCKS).min() > 0.9e-5
