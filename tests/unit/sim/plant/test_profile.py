"""Ramps of a set point: where they end, how fast they change, and what their firmware would do."""

import numpy as np
import pytest

from shared.sim.plant.profile import ramped, slewed
from shared.sim.plant.signals import Signal


def steps(*values, every=0.5):
    return Signal(every * np.arange(len(values)), np.array(values, np.float64)[:, None])


def test_a_step_takes_as_long_as_half_of_it_speeding_up_and_half_slowing_down():
    found = ramped(steps(0.0, 1.0), 16.0, 1e-3, 0.0, 1.2)
    at = found.at - 0.5
    assert found.held(np.array([0.49]))[0, 0] == 0.0
    middle = found.held(np.array([0.5 + 0.25]))[0, 0]  # 2 sqrt(1 / 16) is half a second
    assert middle == pytest.approx(0.5, abs=5e-3)
    assert np.allclose(found.values[at > 0.5 + 1e-9, 0], 1.0)
    rising = (at > 0.0) & (at < 0.25)
    inside = at[rising] + 0.5e-3
    assert np.allclose(found.values[rising, 0], 8.0 * inside**2, atol=1e-9)


def test_a_command_that_comes_on_the_way_is_reached_from_where_it_is_and_as_fast_as_it_is():
    rng = np.random.default_rng(0)
    command = Signal(0.01 * np.arange(100), np.cumsum(rng.normal(0.0, 0.05, (100, 2)), axis=0))
    period, most = 1e-3, 20.0
    found = ramped(command, most, period, 0.0, 1.3)
    places = found.values
    bends = np.diff(places, 2, axis=0) / period**2
    assert np.abs(bends).max() <= most * (1.0 + 1e-6)
    assert np.abs(np.abs(bends) - most).min() < 1e-6
    assert places[-1] == pytest.approx(command.values[-1], abs=1e-9)


def test_a_ramp_may_be_followed_from_a_moment_on():
    command = steps(0.0, 1.0, -1.0, 0.5)
    whole = ramped(command, 50.0, 1e-3, 0.0, 2.0)
    later = ramped(command, 50.0, 1e-3, 0.9, 2.0)  # it has come to rest by then
    at = np.arange(1.0, 2.0, 0.01)
    assert np.allclose(whole.held(at), later.held(at), atol=1e-9)
    assert later.at[0] == command.at[0]  # who counts from the first command still can
    assert np.diff(whole.at).min() > 0.0  # who asks for its speed gets one


def test_a_limited_speed_takes_its_time_over_a_step_and_none_over_what_is_slow():
    found = slewed(steps(0.0, 1.0), 4.0, 1e-3, 0.0, 1.2)
    at = found.at - 0.5
    on_the_way = (at > -1e-9) & (at < 0.25 - 1e-9)
    assert np.allclose(found.values[on_the_way, 0], 4.0 * (at[on_the_way] + 0.5e-3))
    assert np.allclose(found.values[at > 0.25 - 1e-9, 0], 1.0)
    told = Signal(np.arange(0.0, 1.0, 1e-3), 3.0 * np.arange(0.0, 1.0, 1e-3)[:, None])
    slow = slewed(told, 4.0, 1e-3, 0.0, 1.0)
    assert np.abs(slow.held(told.at) - told.values).max() < 3.0 * 1e-3


def test_a_set_point_that_is_behind_goes_on_when_the_next_command_comes():
    found = slewed(steps(0.0, 1.0, 0.0), 1.0, 1e-3, 0.0, 2.0)
    assert found.held(np.array([0.999]))[0, 0] == pytest.approx(0.5, abs=2e-3)
    assert found.held(np.array([1.25]))[0, 0] == pytest.approx(0.25, abs=2e-3)
