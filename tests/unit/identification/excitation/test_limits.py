import numpy as np
import pytest

from shared.identification.excitation.limits import (
    Blade,
    Limits,
    ToolLimits,
    hurry,
    is_inside,
    strain,
)

STILL = np.array([1.0, 0.0, 0.0, 0.0])


def pose(*at: float) -> np.ndarray:
    return np.r_[at, STILL]


def make_limits(tool: ToolLimits | None = None) -> Limits:
    return Limits(
        low=np.array([-1.0]),
        high=np.array([1.0]),
        speed=np.array([2.0]),
        acceleration=np.array([8.0]),
        effort=np.array([10.0]),
        tool=tool,
    )


def test_clearance_is_the_way_to_the_nearest_limit():
    blade = Blade((1.0, 0.0, 0.0), 0.7, -0.1, 0.02)
    tool = ToolLimits(
        (0.0, -1.0, -1.0), (1.0, 1.0, 1.0), ceiling=0.3, keep_out=(2.0, 0.0), keep_out_radius=0.4,
        blade=blade,
    )  # fmt: skip
    poses = np.stack([pose(0.1, 0.0, 0.0), pose(0.5, 0.0, 0.2), pose(0.8, 0.3, 0.0)])
    # The box's side; the ceiling above the blade; the person 0.5 m ahead and 0.3 m aside of its tip
    expected = [0.1, 0.3 - 0.2 - 0.02, np.hypot(0.5, 0.3) - 0.42]
    np.testing.assert_allclose(tool.clearance(poses), expected)
    assert tool.clearance(pose(-0.2, 0.0, 0.0)[None])[0] == pytest.approx(-0.2)


def test_a_motion_that_hurries_k_times_too_much_is_right_k_times_slower():
    limits = make_limits(ToolLimits((-9.0,) * 3, (9.0,) * 3, speed=0.5, acceleration=3.0))
    share = np.linspace(0.0, 1.0, 400)
    way = 0.5 * (1.0 - np.cos(np.pi * share))[:, None]
    poses = np.stack([pose(0.4 * float(each), 0.0, 0.0) for each in way[:, 0]])
    period = 0.5 / 399
    factor = hurry(limits, way, poses, period)
    assert factor > 1.0
    assert hurry(limits, way, poses, factor * period) == pytest.approx(1.0)
    # Half a metre a second of the tool, by hand: 0.4 m / 2 * pi / T; 8 rad/s^2: 1/2 (pi / T)^2
    by_hand = max(0.2 * np.pi / 0.5 / 0.5, (0.5 * np.pi**2 / 8.0) ** 0.5 / 0.5, 0.5 * np.pi)
    assert factor == pytest.approx(by_hand, rel=0.01)


def test_effort_may_peak_but_not_last():
    limits = make_limits()
    efforts = np.zeros((100, 1))
    efforts[40:45] = 9.5  # 50 ms of 95 %
    assert strain(limits, efforts, 0.01)[0] == pytest.approx(0.95)
    efforts[40:55] = 9.5  # 150 ms, where 80 % may last
    assert strain(limits, efforts, 0.01)[0] == pytest.approx(0.95 / 0.8)


def test_a_joint_beyond_its_range_is_not_inside():
    assert is_inside(make_limits(), np.array([[0.9]]), pose(0.0, 0.0, 0.0)[None])
    assert not is_inside(make_limits(), np.array([[1.1]]), pose(0.0, 0.0, 0.0)[None])
