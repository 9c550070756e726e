"""States that parts of a recording begin with, and how well they are known."""

import numpy as np
import pytest

from shared.identification.arm.parts import CUTS, spans_of, states_doubt, states_of
from shared.identification.dataset.types import Float64, Trajectory

CUT, PERIOD, NOISE = CUTS["torque"], 0.002, 1e-4
AT: Float64 = PERIOD * np.arange(10_000)
WAYS = np.array([0.2, 0.5])
NO_STEPS = np.zeros(2)


def recorded(noise: float, step: float = 0.0, count: int = len(AT)) -> Trajectory:
    """Return two joints that swing slowly, read with noise or in steps."""
    rng = np.random.default_rng(7)
    q = np.sin(WAYS * AT[:count, None]) + noise * rng.standard_normal((count, 2))
    if step:
        q = step * np.round(q / step)
    still = np.zeros((count, 2))
    return Trajectory("one", "train", "", q[0], still[0], AT[:count], still, AT[:count], q)


def off(trajectory: Trajectory) -> Float64:
    """Return float64[2, J], how far first positions and speeds are off, root mean square."""
    begins = spans_of(trajectory, CUT)[:, 0]
    found = np.array(states_of(trajectory, begins, 0.0, CUT))
    at = begins[:, None]
    wanted = np.stack([np.sin(WAYS * at), WAYS * np.cos(WAYS * at)], axis=1)
    return np.sqrt(np.mean((found - wanted) ** 2, axis=0))


def test_states_are_off_by_a_third_of_their_doubt_where_readings_are_off_one_by_one():
    noisy = recorded(NOISE)
    doubt = states_doubt([noisy], NO_STEPS, CUT)
    assert doubt is not None
    assert doubt == pytest.approx(3.0 * off(noisy), rel=0.3)


def test_states_of_an_encoder_in_steps_are_within_their_doubt():
    stepped = recorded(0.0, step=3e-4)
    doubt = states_doubt([stepped], np.full(2, 3e-4 / np.sqrt(12.0)), CUT)
    assert doubt is not None
    assert np.all(off(stepped) < doubt)
    assert np.all(off(stepped) > 0.1 * doubt)


def test_what_steps_hide_is_doubted_where_nothing_moves():
    still = recorded(0.0, step=10.0)
    doubt = states_doubt([still], np.array([1e-3, 2e-3]), CUT)
    assert doubt is not None
    assert doubt[:, 1] == pytest.approx(2.0 * doubt[:, 0])
    assert doubt[0, 0] > 1e-4


def test_of_recordings_too_short_nothing_is_known():
    assert states_doubt([recorded(NOISE, count=20)], NO_STEPS, CUT) is None
