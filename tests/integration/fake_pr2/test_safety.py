"""What a policy, a tracker or a machine may do wrong, on the twin and on the fake PR2."""

import math
from collections.abc import Iterator

import numpy as np
import pytest

from services.robot_io.limits import Blade, Space
from services.robot_io.service import pose_of
from tests.integration.fake_pr2.lab import needs_ros
from tests.integration.fake_pr2.lockstep import (
    PERIOD,
    REACH,
    Lockstep,
    Policy,
    extent,
    silent,
    stay,
    up_and_down,
)


@pytest.fixture
def robot(request: pytest.FixtureRequest) -> Iterator[Lockstep]:
    robot = Lockstep(request.param)
    yield robot
    robot.close()


def on(*pr2_marks: pytest.MarkDecorator) -> pytest.MarkDecorator:
    """Run it on the twin and on the fake PR2, there with these marks."""
    pr2 = pytest.param("pr2", marks=[needs_ros, *pr2_marks])
    return pytest.mark.parametrize("robot", ["twin", pr2], indirect=True)


quick, both = on(), on(pytest.mark.slow)


def not_a_number(tick: int) -> np.ndarray:
    return np.full(6, math.nan)


def jumping(tick: int) -> np.ndarray:
    """Metres away, elsewhere each time."""
    return np.array([3.0 * math.sin(17.0 * tick), 5.0 * (-1.0) ** tick, 0.4, 0.0, 0.0, 0.0])


def wild(tick: int) -> np.ndarray:
    """As far as it may be and further, everywhere, and turning."""
    return np.array(
        [0.15 * math.sin(0.31 * tick), 0.15 * (-1.0) ** (tick // 40), 0.15 * math.cos(0.17 * tick),
         *[0.5 * math.sin(0.11 * tick)] * 3]
    )  # fmt: skip


def outward(tick: int) -> np.ndarray:
    """Always out of the box, at the person."""
    return np.array([0.1, -0.1, 0.1, 0.0, 0.0, 0.0])


@both
@pytest.mark.parametrize("wrong", [not_a_number, jumping, silent])
def test_commands_that_are_none_hold_then_trip_and_a_sound_one_alone_moves_nothing(
    robot: Lockstep, wrong: Policy
):
    robot.move()
    count = len(robot.seen)
    robot.policy = wrong
    robot.until(lambda: robot.mode() == "tripped", 0.7)
    modes = [gate.mode for gate in robot.seen[count:]]
    assert modes.index("holding") < modes.index("tripped")
    reason = robot.seen[-1].reason
    assert "unusable commands" in reason if wrong is jumping else "no usable command" in reason
    robot.policy = up_and_down
    robot.stays_shut()
    robot.rearm()


@both
def test_nobody_can_arm_under_commands_that_are_none(robot: Lockstep):
    for wrong in (not_a_number, jumping, silent):
        robot.policy = wrong
        robot.rest(0.3)
        reply = robot.ask("arm")
        assert not reply.accepted
        assert any("no usable command" in reason for reason in reply.reasons)
    assert robot.service.health().counters["commands_sent"] == 0


@both
def test_a_lost_bat_holds_and_a_found_one_lets_it_go_on(robot: Lockstep):
    robot.move()
    robot.is_tracked = False
    robot.until(lambda: robot.mode() == "holding", 0.25)
    assert "not tracked" in robot.seen[-1].reason
    robot.stays()
    assert robot.mode() == "holding"
    count, found = len(robot.states), robot.clock.now()
    robot.is_tracked = True
    robot.until(lambda: robot.mode() == "armed", 1.0)
    assert robot.clock.now() - found > 0.3  # it has to be seen for a while, and good for a while
    robot.until(lambda: extent(robot.tools(count)) > 0.02, 2.0)


@both
def test_a_loop_that_stood_still_for_a_second_stops_the_arm_first(robot: Lockstep):
    robot.move()
    before = robot.seen[-1].commanded
    robot.clock.advance(1.0)
    robot.tick(2)
    # The twin's state is always of now; a PR2's was not heard for a second.
    assert robot.mode() == ("holding" if robot.fake is None else "tripped")
    braking = 0.6**2 / (2.0 * robot.safety.acceleration)
    assert np.linalg.norm(robot.seen[-1].commanded[:3] - before[:3]) < braking
    if robot.fake is not None:
        robot.stays_shut()
        robot.rearm()


@quick
def test_the_run_stop_pressed_and_released_moves_nothing_until_a_person_arms(robot: Lockstep):
    robot.move()
    robot.press_run_stop()
    robot.trips("run stop", 0.15)
    assert not robot.ask("reset").accepted
    robot.rest(0.5)
    robot.release_run_stop()
    robot.rest(2.5)  # a PR2 has reset its motors and restarted its controllers by now
    if robot.fake is not None:
        assert not robot.fake.is_halted
        assert "r_cart" in robot.fake.running()
    robot.stays_shut()
    robot.until(lambda: robot.ask("reset").accepted, 3.0)
    robot.put_back()
    robot.stays(0.3)
    robot.move()


@both
def test_a_controller_that_was_started_anew_trips(robot: Lockstep):
    robot.move()
    robot.restart_controller()
    robot.trips("restarted", 0.1)
    robot.stays_shut()
    robot.rearm()


@both
@pytest.mark.parametrize("policy", [wild, outward, up_and_down])
def test_no_policy_leads_a_command_over_a_limit(robot: Lockstep, policy: Policy):
    cfg, gate = robot.safety, robot.parts.gate
    robot.move(up_and_down)
    robot.policy = policy
    first = len(robot.seen)
    robot.rest(4.0)
    sent = robot.seen[first:]
    assert all(gate.is_sent for gate in sent)
    commands = np.array([gate.commanded for gate in sent])
    tools = np.array([states.tools[1] for states in robot.states[-len(sent) :]])
    assert np.isfinite(commands).all()
    places = commands[:, :3]
    assert (places >= np.array(cfg.box_low) - 1e-6).all()
    assert (places <= np.array(cfg.box_high) + 1e-6).all()
    assert min(gate.space.clearance(pose_of(command)) for command in commands) >= -1e-6
    velocities = np.diff(places, axis=0) / PERIOD
    speeds = np.linalg.norm(velocities, axis=1)
    assert speeds.max() <= cfg.game_speed + 1e-6
    changes = np.linalg.norm(np.diff(velocities, axis=0), axis=1)
    assert changes.max() <= cfg.acceleration * PERIOD + 1e-6
    leads = np.linalg.norm(places - tools[:, :3], axis=1)
    assert leads.max() <= cfg.lead + 1e-6
    if policy is wild:
        assert changes.max() > 0.9 * cfg.acceleration * PERIOD  # the limits were at work
    if policy is outward:
        space = Space(cfg, Blade((1.0, 0.0, 0.0), 0.0, 0.0, 0.0))
        assert space.clearance(pose_of(commands[-1])) < 0.1  # it did go to the edge


@both
@pytest.mark.parametrize("policy", [wild, up_and_down])
def test_no_policy_makes_the_arm_too_fast_or_too_strong(robot: Lockstep, policy: Policy):
    robot.move(up_and_down)
    robot.policy = policy
    forces, speeds = [], []
    for _ in range(300):
        robot.tick()
        state = robot.service._robot
        forces.append(state.force or 0.0)
        speeds.append(state.speed)
    # A spring of at most 15 N and the damper of 15 N s/m.
    assert max(forces) <= 15.0 * (1.0 + max(speeds)) + 1e-6
    assert max(forces) < robot.safety.force_trip
    assert max(speeds) < 0.8
    assert robot.mode() == "armed"


@quick
def test_a_robot_that_nobody_armed_hears_nothing(robot: Lockstep):
    for policy in (up_and_down, wild, outward, stay):
        robot.policy = policy
        robot.rest(0.5)
    assert {gate.mode for gate in robot.seen} == {"disarmed"}
    assert robot.service.health().counters["commands_sent"] == 0
    assert extent(robot.tools(0)) < 1e-4
    if robot.fake is not None:
        assert robot.fake.commands() == []


@both
def test_disarming_is_at_once_and_stays(robot: Lockstep):
    robot.move()
    assert robot.ask("disarm").mode == "disarmed"
    count = len(robot.states)
    robot.stays()
    assert extent(robot.tools(count)) < 0.05 + REACH
    assert robot.mode() == "disarmed"
