"""A known mounting is found again, and poses that cannot tell it are refused."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from services.robot_io.vive.hand_eye import LEAST_SPREAD, Refused, solve, spread_of
from tests.unit.calibration.making import pairs, truth


def errors_mm(count: int, outliers: float) -> np.ndarray:
    """Return the mean error within a metre, and what was expected, for three draws."""
    found = []
    for seed in range(3):
        rng = np.random.default_rng(seed)
        known = truth(rng)
        result = solve(*pairs(known, rng, count, outliers=outliers), rng)
        error = known.error_within_a_metre(result.torso_from_base, rng)
        found.append((error, result.expected, result.held_out))
    return 1e3 * np.array(found)


def test_thirty_poses_find_the_base_stations_within_three_millimetres():
    error, expected, held_out = errors_mm(30, 0.0).T
    assert error.mean() < 3.3
    assert error.max() < 8.0
    assert expected.mean() == pytest.approx(1.3 * error.mean(), rel=0.25)  # RMS of a vector
    assert held_out.max() < 8.0


def test_a_tenth_of_outliers_costs_little():
    assert errors_mm(30, 0.1)[:, 0].mean() < 3.6


def test_the_outliers_are_those_left_out():
    rng = np.random.default_rng(3)
    tracker, tool = pairs(truth(rng), rng, outliers=0.1)
    assert np.flatnonzero(~solve(tracker, tool, rng).used).tolist() == [0, 1, 2]


def test_without_noise_the_mounting_is_exact():
    rng = np.random.default_rng(4)
    known = truth(rng)
    tracker, _ = pairs(known, rng)
    (base, base_at), (mount, mount_at) = known
    turned = Rotation.from_quat(tracker[:, 3:], scalar_first=True)
    exact = (base * turned * mount).as_quat(scalar_first=True)
    places = base.apply(turned.apply(mount_at) + tracker[:, :3]) + base_at
    found = solve(tracker, np.hstack([places, exact]), rng)
    assert found.residual < 1e-6
    assert found.tracker_from_tool[:3] == pytest.approx(mount_at, abs=1e-5)


def test_small_turns_are_refused_though_the_poses_fit():
    rng = np.random.default_rng(5)
    with pytest.raises(Refused, match=r"turned by 1\.\d degrees .* at least 8 are needed"):
        solve(*pairs(truth(rng), rng, degrees=3.0), rng)


def test_turns_about_one_axis_only_are_refused():
    rng = np.random.default_rng(6)
    tracker, tool = pairs(truth(rng), rng)
    angles = np.linspace(-0.6, 0.6, len(tool))
    tracker[:, 3:] = np.column_stack([np.cos(angles), np.sin(angles), 0 * angles, 0 * angles])
    assert spread_of(tracker) < LEAST_SPREAD
    with pytest.raises(Refused, match="about every axis"):
        solve(tracker, tool, rng)


def test_a_tracker_that_is_not_fixed_is_refused():
    rng = np.random.default_rng(7)
    tracker, tool = pairs(truth(rng), rng)
    tracker[:, :3] += rng.normal(0.0, 0.02, (len(tool), 3))
    with pytest.raises(Refused, match=r"of 30 poses miss by more than 10 mm"):
        solve(tracker, tool, rng)


@pytest.mark.parametrize(
    ("count", "shift", "seed", "why"),
    [
        (15, 0.007, 5, r"poses held out miss by 8\.\d mm \(RMS\), limit 8"),
        (18, 0.0075, 4, r"a bat would be off by \d+\.\d mm \(RMS\) within 1 m, limit 8"),
    ],
)
def test_poses_that_fit_each_other_and_foretell_too_little_are_refused(
    count: int, shift: float, seed: int, why: str
):
    rng = np.random.default_rng(seed)
    tracker, tool = pairs(truth(rng), rng, count)
    off = rng.normal(size=(count, 3))
    tool[:, :3] += shift * off / np.linalg.norm(off, axis=1)[:, None]
    with pytest.raises(Refused, match=why):
        solve(tracker, tool, rng)


def test_too_few_poses_are_refused():
    rng = np.random.default_rng(9)
    with pytest.raises(Refused, match="5 poses, at least 15 are needed"):
        solve(*pairs(truth(rng), rng, 5), rng)


@pytest.mark.parametrize("rows", [np.zeros((3, 6)), np.full((20, 7), np.nan)])
def test_what_are_no_poses_is_a_callers_bug(rows: np.ndarray):
    with pytest.raises(ValueError, match=r"expected twice|not finite"):
        solve(rows, rows, np.random.default_rng(0))
