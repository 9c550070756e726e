import numpy as np
import pytest

from shared.identification.hidden import programmes
from shared.identification.hidden.programmes import GENTLE, PERIOD, TEST, TRAIN
from shared.sim.hidden.arms import ARMS

AT = PERIOD * np.arange(600)
ALL = dict((*TRAIN, *TEST, *GENTLE))


def made(arm, name, seed=1):
    return ALL[name](ARMS[arm], AT, np.random.default_rng(seed))


@pytest.mark.parametrize("arm", ARMS)
@pytest.mark.parametrize("name", ALL)
def test_a_programme_begins_at_rest_and_stays_within_reach(arm, name):
    q = made(arm, name)
    assert np.abs(q[1] - q[0]).max() < 2e-3
    assert np.all(np.abs(q) <= 1.2 * ARMS[arm].reach)


@pytest.mark.parametrize("name", ["sines", "swings", "mixed", "gentle"])
def test_joints_go_about_as_fast_as_they_may_and_no_faster(name):
    arm = ARMS["arm3"]
    speed = np.abs(np.diff(made("arm3", name), axis=0)).max(axis=0) / PERIOD
    assert np.all(speed < 1.3 * arm.speed)
    if name == "swings":
        assert np.max(speed / arm.speed) > 0.9


def test_gentle_motion_is_slow():
    arm = ARMS["pr2"]
    speed = np.abs(np.diff(made("pr2", "gentle"), axis=0)).max(axis=0) / PERIOD
    assert np.all(speed < 0.6 * arm.speed)


def test_no_two_programmes_are_alike():
    rng = np.random.default_rng(3)
    one, other = (programmes.sines(ARMS["arm3"], AT, rng) for _ in range(2))
    assert np.abs(one - other).max() > 0.3
