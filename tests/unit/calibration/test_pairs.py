import numpy as np
import pytest

from services.robot_io.vive.pairs import PairCollector, apart

HERE = np.array([0.5, 0.0, 0.1, 1.0, 0.0, 0.0, 0.0])


class Arm:
    """A gripper with a tracker, both seen a hundred times a second."""

    def __init__(self) -> None:
        self.collector = PairCollector()
        self.rng = np.random.default_rng(1)
        self.now = 10.0
        self.taken = 0

    def hold(self, pose: np.ndarray, seconds: float = 0.7, drift: float = 0.0) -> "Arm":
        for _ in range(round(seconds * 100)):
            self.now += 0.01
            pose = pose + drift * 0.01 * np.eye(7)[0]
            noise = np.zeros(7)
            noise[:3] = self.rng.normal(0.0, 0.0003, 3)
            self.collector.offer("tool", pose, self.now)
            self.collector.offer("tracker", pose + noise, self.now)
            self.taken += self.collector.take(self.now) is not None
        return self


def moved(metres: float, radians: float = 0.0) -> np.ndarray:
    pose = HERE.copy()
    pose[1] += metres
    pose[3:] = np.cos(radians / 2), 0.0, 0.0, np.sin(radians / 2)
    return pose


def test_a_pose_that_is_held_for_half_a_second_is_taken_once():
    arm = Arm().hold(HERE, 0.4)
    assert arm.taken == 0
    arm.hold(HERE, 3.0)
    assert arm.taken == 1
    assert arm.collector.is_alike
    pair = arm.collector.pairs[0]
    assert pair.tool == pytest.approx(HERE)
    assert pair.tracker == pytest.approx(HERE, abs=2e-4)


@pytest.mark.parametrize(("metres", "radians", "is_new"), [
    (0.04, 0.0, True), (0.0, 0.2, True), (0.0, -0.2, True), (0.02, 0.1, False),
])  # fmt: skip
def test_the_next_pose_must_be_another(metres: float, radians: float, is_new: bool):
    arm = Arm().hold(HERE).hold(moved(metres, radians))
    assert arm.taken == 1 + is_new


def test_an_arm_that_creeps_is_not_still():
    assert Arm().hold(HERE, 2.0, drift=0.01).taken == 0
    assert Arm().hold(HERE, 2.0, drift=0.001).taken == 1


def test_a_tracker_that_is_lost_in_between_begins_again():
    arm = Arm().hold(HERE, 0.45)
    arm.collector.lose("tracker")
    assert arm.hold(HERE, 0.3).taken == 0
    assert arm.hold(HERE, 0.4).taken == 1


def test_a_gap_begins_again():
    arm = Arm().hold(HERE, 0.45)
    arm.now += 0.3
    assert arm.hold(HERE, 0.3).taken == 0


def test_quaternions_of_both_signs_are_one_orientation():
    arm = Arm()
    for tick in range(70):
        arm.now += 0.01
        sign = (-1.0) ** tick
        pose = np.concatenate([HERE[:3], sign * HERE[3:]])
        arm.collector.offer("tool", pose, arm.now)
        arm.collector.offer("tracker", pose, arm.now)
        arm.taken += arm.collector.take(arm.now) is not None
    assert arm.taken == 1
    assert np.abs(arm.collector.pairs[0].tool[3]) == pytest.approx(1.0)


def test_small_turns_are_measured():
    assert apart(HERE, moved(0.0, 1e-6))[1] == pytest.approx(1e-6, rel=1e-3)
    assert apart(HERE, moved(0.3, 2.0)) == pytest.approx((0.3, 2.0))
