import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from services.page.hand import MAX_STEP_SECONDS, Floats, Hand, Reach
from shared.game.geometry import BatShape, Target, blade_direction

TARGET = Target()
BAT = BatShape()
SPEED, TURN = 3.0, 6.0


def made() -> Hand:
    return Hand(Reach.of(1.0, TARGET), BAT, SPEED, TURN)


def tip_of(pose: Floats) -> Floats:
    return pose[:3] + BAT.front * blade_direction(pose[3:])


def settled(hand: Hand, tip: tuple[float, float, float], roll: float = 0.0) -> Floats:
    hand.want(tip, roll)
    for _ in range(200):
        hand.step(0.01)
    return hand.pose()


@pytest.mark.parametrize("roll", [0.0, 0.5, -2.0, math.pi])
@pytest.mark.parametrize("tip", [(0.1, 0.0, 1.05), (-0.4, -0.5, 0.6), (0.6, 0.8, 1.7)])
def test_the_tip_of_the_bat_goes_where_it_is_wanted(tip: tuple[float, float, float], roll: float):
    pose = settled(made(), tip, roll)
    assert tip_of(pose) == pytest.approx(np.array(tip), abs=1e-9)
    assert np.linalg.norm(pose[3:]) == pytest.approx(1.0)


def test_the_hand_stays_on_the_persons_side_and_below_a_tip_that_is_not_rolled():
    for y in np.linspace(-0.9, 0.9, 7):
        pose = settled(made(), (0.0, float(y), 1.05))
        assert pose[0] > 0.4
        assert pose[2] < 1.05


def test_roll_turns_the_hand_about_the_way_the_bat_points():
    tip = (0.1, 0.0, 1.05)
    straight, right = settled(made(), tip), settled(made(), tip, math.pi / 2)
    over = settled(made(), tip, math.pi)
    assert right[1] < straight[1] - 0.2  # the blade leans to the person's right, its hand left
    assert over[2] > straight[2] + 0.4


def test_a_tip_out_of_reach_is_held_at_the_edge_of_it():
    reach = Reach.of(1.0, TARGET)
    assert tip_of(settled(made(), (-5.0, 5.0, -5.0))) == pytest.approx(
        np.array([reach.low[0], reach.high[1], reach.low[2]])
    )


def test_a_step_takes_no_more_time_than_it_may_so_that_a_stall_is_no_leap():
    hand = made()
    before = hand.tip
    hand.want((-0.4, 0.9, 1.7), 0.0)
    hand.step(5.0)
    assert math.dist(hand.tip, before) == pytest.approx(SPEED * MAX_STEP_SECONDS)


def test_the_bats_frame_turns_continuously_through_a_whole_roll():
    hand = made()
    poses: list[Floats] = []
    for k in range(400):
        hand.want((0.1, 0.0, 1.05), math.remainder(k * 0.03, math.tau))
        poses.append(hand.step(0.01))
    turned = np.abs(np.sum(np.array(poses)[1:, 3:] * np.array(poses)[:-1, 3:], axis=1))
    assert turned.min() > math.cos(0.04)


@given(
    st.lists(
        st.tuples(
            *[st.floats(-100.0, 100.0)] * 3, st.floats(-math.pi, math.pi), st.floats(-1.0, 10.0)
        ),
        min_size=1, max_size=20,
    )
)  # fmt: skip
def test_whatever_the_mouse_does_grip_and_tip_are_slow_enough_to_be_believed(
    wishes: list[tuple[float, float, float, float, float]],
):
    hand = made()
    before = hand.pose()
    for x, y, z, roll, seconds in wishes:
        hand.want((x, y, z), roll)
        pose = hand.step(seconds)
        assert np.isfinite(pose).all()
        assert np.linalg.norm(tip_of(pose) - tip_of(before)) <= SPEED * MAX_STEP_SECONDS + 1e-9
        # robot_io takes what is 5 cm beyond where it was heading for a jump.
        assert np.linalg.norm(pose[:3] - before[:3]) < 0.05
        assert abs(np.dot(pose[3:], before[3:])) > math.cos(0.5 * 60.0 * 0.01)
        before = pose
