import tomllib
from pathlib import Path

import numpy as np
import pytest

import shared.sim.arm
from shared.sim.arm import Inertial, combine, load_arm
from shared.sim.parameters import JOINT_NAMES

DATA = tomllib.loads((Path(shared.sim.arm.__file__).parent / "data/pr2_arm.toml").read_text())


def test_every_number_of_the_arm_names_its_source():
    for joint in DATA["joints"]:
        assert all("src" in entry for entry in joint.values() if isinstance(entry, dict))
    assert all("src" in link for link in DATA["links"])


def test_an_arm_has_the_seven_joints_in_order_from_the_shoulder():
    for side in ("right", "left"):
        assert tuple(joint.name for joint in load_arm(side).joints) == JOINT_NAMES


def test_soft_limits_lie_inside_the_hard_ones_on_both_sides():
    for side in ("right", "left"):
        for joint, entry in zip(load_arm(side).joints, DATA["joints"], strict=True):
            limit = entry.get(f"limit_{side}")
            if limit is None:
                assert joint.range is None
            else:
                assert joint.range is not None
                assert limit["value"][0] <= joint.range[0] < joint.range[1] <= limit["value"][1]


def test_the_left_arm_mirrors_the_right_one():
    right, left = load_arm("right"), load_arm("left")
    assert left.joints[0].origin == (0.0, 0.188, 0.0)
    assert right.joints[0].origin == (0.0, -0.188, 0.0)
    for mirrored in (0, 2):
        low, high = right.joints[mirrored].range or (0, 0)
        assert left.joints[mirrored].range == (-high, -low)
    # The upper arms are different castings; everything further out is the same.
    assert right.joints[2].inertial.com[1] == pytest.approx(-0.01621)
    assert left.joints[2].inertial.com[1] == pytest.approx(0.01658)
    assert right.joints[6].inertial.mass == left.joints[6].inertial.mass


def test_the_gripper_with_its_fingers_hangs_on_the_last_joint():
    mass = 0.58007 + 0.17126 + 0.17389 + 2 * 0.04419
    assert load_arm("right").joints[6].inertial.mass == pytest.approx(mass)


def test_two_points_on_a_stick_have_the_inertia_of_hand_arithmetic():
    points = [Inertial(2.0, np.array([x, 0.0, 0.0]), np.zeros((3, 3))) for x in (-1.0, 3.0)]
    both = combine(points)
    assert both.mass == 4.0
    assert both.com == pytest.approx([1.0, 0.0, 0.0])
    assert both.inertia == pytest.approx(np.diag([0.0, 16.0, 16.0]))
