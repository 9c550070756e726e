from dataclasses import replace

import numpy as np
import pytest

from shared.identification.arm.subject import Subject
from shared.identification.catalogue.dropped_packets import EFFECT as DROPPED
from shared.identification.catalogue.sample_and_hold import EFFECT as HELD
from shared.identification.dataset.types import Float64, Trajectory
from shared.identification.laws.outages import lost_at, without
from shared.sim.plant.replay import Recorded
from shared.sim.plant.rollouts import Rollouts
from shared.sim.plant.row import Row
from shared.sim.plant.signals import Signal
from tests.arms import make_plant, make_subject, recorded, replay


@pytest.fixture(scope="module")
def subject(tmp_path_factory: pytest.TempPathFactory) -> Subject:
    return make_subject(make_plant(tmp_path_factory.mktemp("arm"), has_gravity=False))


def _turning(at: Float64) -> Float64:
    return np.stack([0.8 * at, 0.0 * at, 0.0 * at], axis=1)


def _command(subject: Subject, period: float, recording: Recorded, phase: float = 0.0) -> Signal:
    """Return what reaches the controller."""
    seen: list[Signal] = []

    def enter(row: Row) -> None:
        HELD.enter(row, "", np.array([period, phase]))
        seen.append(row.command)

    Rollouts(subject.plant, (), 1).run([(enter, recording)])
    return seen[0]


def test_a_controller_that_looks_every_50_ms_takes_every_fifth_command(subject: Subject):
    ramp = recorded(_turning)
    taken = _command(subject, 0.05, ramp)
    at: Float64 = np.arange(0.0, 0.95, 0.01)
    np.testing.assert_allclose(taken.held(at)[:, 0], 0.8 * 0.05 * np.floor(at / 0.05 + 1e-9))
    np.testing.assert_array_equal(taken.held(np.array([9.0]))[0], ramp.command.values[-1])


def test_an_interval_that_is_no_multiple_takes_the_newest_command(subject: Subject):
    taken = _command(subject, 0.025, recorded(_turning))
    np.testing.assert_allclose(taken.at[:4], [0.0, 0.025, 0.05, 0.075])
    np.testing.assert_allclose(taken.values[:4, 0], [0.0, 0.8 * 0.02, 0.8 * 0.05, 0.8 * 0.07])


def test_a_late_first_turn_takes_older_commands(subject: Subject):
    taken = _command(subject, 0.05, recorded(_turning), phase=0.5)
    np.testing.assert_allclose(taken.at[:4], [0.0, 0.025, 0.075, 0.125])
    np.testing.assert_allclose(taken.values[:4, 0], [0.0, 0.8 * 0.02, 0.8 * 0.07, 0.8 * 0.12])


def test_holding_lags_by_half_an_interval_on_average(subject: Subject):
    ramp = recorded(_turning, seconds=3.0)
    plain = replay(subject, ramp)
    held = replay(subject, ramp, HELD, "", [0.1, 0.0])
    lag = np.mean(plain.q[150:250, 0] - held.q[150:250, 0]) / 0.8
    assert lag == pytest.approx(0.045, abs=0.003)  # (0.1 - 0.01) / 2: commands step by themselves


def test_a_command_in_a_gap_of_the_log_is_known():
    joints_at: Float64 = np.array([0.0, 0.1, 0.2, 0.3, 1.0, 1.1, 1.2, 1.3])
    command_at: Float64 = np.array([-0.5, 0.25, 0.3, 0.6, 0.99, 1.0, 1.25, 7.0])
    expected = [False, False, False, True, True, False, False, False]
    np.testing.assert_array_equal(lost_at(command_at, joints_at), expected)


def test_what_is_lost_in_a_gap_is_held_and_a_share_of_it_half_way():
    joints_at: Float64 = np.array([0.0, 0.1, 0.2, 0.3, 1.0, 1.1, 1.2, 1.3])
    ramp = Signal(
        np.array([0.0, 0.25, 0.5, 0.75, 1.0]), np.array([[0.0], [1.0], [2.0], [3.0], [4.0]])
    )
    np.testing.assert_allclose(without(ramp, joints_at, 1.0).values[:, 0], [0, 1, 1, 1, 4])
    np.testing.assert_allclose(without(ramp, joints_at, 0.5).values[:, 0], [0, 1, 1.5, 2, 4])
    np.testing.assert_array_equal(without(ramp, joints_at, 0.0).values, ramp.values)


def test_a_lost_pose_keeps_to_the_short_way_round():
    joints_at: Float64 = np.array([0.0, 0.1, 0.2, 0.3, 1.0, 1.1, 1.2, 1.3])
    start = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]
    same = [1.0, 0.0, 0.0, -np.cos(0.1), 0.0, 0.0, -np.sin(0.1)]
    poses = Signal(np.array([0.0, 0.5]), np.array([start, same]))
    half = without(poses, joints_at, 0.5).values[1]
    np.testing.assert_allclose(half, [0.5, 0, 0, -np.cos(0.05), 0, 0, -np.sin(0.05)], atol=1e-9)


def test_lost_commands_stop_a_turning_arm_for_the_gap(subject: Subject):
    ramp = recorded(_turning, seconds=3.0)
    has_arrived = (ramp.joints_at < 1.5) | (ramp.joints_at >= 1.8)
    gap = replace(
        ramp, logged_q=Signal(ramp.joints_at[has_arrived], ramp.logged_q.values[has_arrived])
    )
    plain = replay(subject, gap)
    lost = replay(subject, gap, DROPPED, "", [1.0])
    behind = 0.8 * ramp.joints_at - lost.q[:, 0]
    np.testing.assert_allclose(lost.q[:150], plain.q[:150], atol=1e-9)
    # Held 1.49 to 1.8 s: at its end the arm is 0.31 s behind, less what it still ran on.
    assert behind[179] - behind[149] == pytest.approx(0.8 * 0.3, abs=0.05)
    assert lost.q[-1, 0] == pytest.approx(plain.q[-1, 0], abs=5e-3)


def test_packets_are_dropped_only_where_the_log_has_gaps_with_commands_in_them(subject: Subject):
    at: Float64 = np.arange(0.0, 2.0, 0.01)
    whole = Trajectory(
        "whole", "train", "", np.zeros(3), np.zeros(3), at, np.zeros((200, 3)), at,
        np.zeros((200, 3)),
    )  # fmt: skip
    kept = (at < 1.0) | (at > 1.2)
    holed = replace(whole, joints_at=at[kept], q=whole.q[kept])
    unsent = replace(holed, command_at=at[kept], command=whole.command[kept])
    assert DROPPED.places(replace(subject, recordings=(whole, holed))) == ("",)
    assert DROPPED.places(replace(subject, recordings=(whole,))) == ()
    assert DROPPED.places(replace(subject, recordings=(replace(holed, split="test"),))) == ()
    assert DROPPED.places(replace(subject, recordings=(unsent,))) == ()
