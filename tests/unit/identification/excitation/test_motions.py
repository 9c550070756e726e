import numpy as np
import pytest

from shared.identification.excitation import motions

REACH = np.array([0.8, 0.5, 1.0])


def rng() -> np.random.Generator:
    return np.random.default_rng(4)


@pytest.mark.parametrize(
    "motion",
    [
        motions.sines(8.0, REACH, rng()),
        motions.crawl(10.0, 0.025, REACH, rng()),
        motions.chirp(5.0, 9.0, REACH, rng()),
        motions.visits(
            motions.far(3, REACH, rng()),
            np.full(4, 0.5),
            lambda start, end: 0.7,
            motions.DITHER,
            rng(),
        ),
    ],
)
def test_every_motion_begins_and_ends_at_home_at_rest(motion: np.ndarray):
    np.testing.assert_allclose(motion[[0, -1]], 0.0, atol=1e-9)
    speed = np.abs(np.diff(motion, axis=0)) / motions.PERIOD
    assert np.all(speed[0] < 0.02 * speed.max(axis=0))
    assert np.all(np.abs(motion) <= REACH + motions.DITHER)  # the dither of a posture


def test_postures_of_a_grid_take_every_level_of_every_joint_once():
    postures = motions.spread(8, REACH, rng())
    levels = np.sort(postures / REACH, axis=0)
    np.testing.assert_allclose(levels, np.tile(np.linspace(-0.875, 0.875, 8)[:, None], 3))


def test_a_crawl_keeps_to_its_speeds_and_reverses():
    motion = motions.crawl(20.0, 0.025, REACH, rng())
    speed = np.abs(np.diff(motion, axis=0)) / motions.PERIOD
    slow, fast = speed[100:900], speed[1100:1900]
    assert np.median(slow) == pytest.approx(0.025, rel=0.3)
    assert np.median(fast) == pytest.approx(0.1, rel=0.3)
    signs = np.sign(np.diff(motion[100:1900], axis=0))
    assert np.all((np.diff(signs, axis=0) != 0).sum(axis=0) >= 2)


def test_a_chirp_reaches_its_highest_frequency_at_an_even_acceleration():
    motion = motions.chirp(6.0, 9.0, REACH, rng())[:, 0]
    ups = np.flatnonzero((motion[:-1] < 0.0) & (motion[1:] >= 0.0)) * motions.PERIOD
    late = ups[(ups > 5.0) & (ups < 5.9)]
    assert np.mean(1.0 / np.diff(late)) == pytest.approx(9.0 * 18.0 ** (-0.55 / 6.0), rel=0.15)
    acceleration = np.abs(np.diff(motion, 2)) / motions.PERIOD**2
    assert acceleration[450:540].max() == pytest.approx(acceleration[330:400].max(), rel=0.35)
