"""Positions and speeds from noisy readings."""

import numpy as np
import pytest

from shared.identification.arm.smoothing import smooth, smooth_states
from shared.identification.dataset.types import Float64

PERIOD, WIDTH, NOISE = 0.005, 21, 2e-4
AT: Float64 = np.arange(0.0, 4.0, PERIOD)


def noisy(way: Float64) -> Float64:
    return (way + NOISE * np.random.default_rng(3).standard_normal(len(way)))[:, None]


@pytest.mark.parametrize("hertz", [6.0, 8.0])
def test_a_fast_motion_to_and_fro_keeps_its_speed(hertz: float) -> None:
    turn = 2.0 * np.pi * hertz
    readings, speed = noisy(0.1 * np.sin(turn * AT)), 0.1 * turn * np.cos(turn * AT)
    inner = slice(WIDTH, -WIDTH)
    found = smooth_states(readings, WIDTH, PERIOD)[1][inner, 0]
    cubic = smooth(readings, WIDTH, PERIOD)[inner, 0]
    off, without = (float(np.std(each - speed[inner])) for each in (found, cubic))
    assert off < 0.2 * without
    assert off < 0.005 * 0.1 * turn


def test_a_slow_motion_is_no_noisier_than_on_cubics() -> None:
    readings = noisy(0.1 * np.sin(2.0 * AT))
    position, speed = smooth_states(readings, WIDTH, PERIOD)
    assert np.mean(position != smooth(readings, WIDTH)) < 0.02
    assert np.mean(speed != smooth(readings, WIDTH, PERIOD)) < 0.02


def test_only_where_a_motion_is_fast_is_more_of_it_followed() -> None:
    fast = 0.1 * np.sin(2.0 * np.pi * 7.0 * AT) * (AT > 3.0)
    readings = noisy(fast)
    is_other = (smooth_states(readings, WIDTH, PERIOD)[1] != smooth(readings, WIDTH, PERIOD))[:, 0]
    assert np.mean(is_other[AT > 3.1]) > 0.5
    assert np.mean(is_other[AT < 2.9]) < 0.02
