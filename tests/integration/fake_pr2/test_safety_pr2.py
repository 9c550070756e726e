"""A PR2 that is halted, silent, held, dragged or shared while a policy streams."""

from collections.abc import Iterator

import numpy as np
import pytest

from shared.ros.node import Node
from shared.testing.fake_pr2.fake import FakePr2
from tests.integration.fake_pr2.lab import needs_ros
from tests.integration.fake_pr2.lockstep import Lockstep, extent

pytestmark = needs_ros


@pytest.fixture
def robot() -> Iterator[Lockstep]:
    robot = Lockstep("pr2")
    yield robot
    robot.close()


def fake_of(robot: Lockstep) -> FakePr2:
    assert robot.fake is not None
    return robot.fake


@pytest.mark.slow
def test_the_wireless_stop_trips_and_its_release_moves_nothing(robot: Lockstep):
    fake = fake_of(robot)
    robot.move()
    fake.press_wireless_stop()
    robot.trips("stop", 0.15)
    robot.rest(0.5)
    fake.release_wireless_stop()
    robot.until(lambda: not fake.is_halted, 3.0)
    robot.stays_shut()


@pytest.mark.slow
def test_nothing_is_sent_after_the_power_board_has_told_of_the_stop(robot: Lockstep):
    fake = fake_of(robot)
    robot.move()
    pressed = robot.clock.now()
    fake.press_run_stop()
    robot.rest(1.0)
    late = [command.at - pressed for command in fake.commands(pressed)]
    assert max(late) <= 0.11  # the board says it ten times a second


@pytest.mark.slow
def test_a_halt_that_is_told_late_trips_and_the_reset_moves_nothing(robot: Lockstep):
    fake = fake_of(robot)
    robot.move()
    fake.halt_motors()
    robot.until(lambda: robot.mode() == "tripped", 1.1)
    fake.reset_motors()
    robot.until(lambda: not fake.is_halted)
    robot.stays_shut()
    robot.rearm()


def test_a_halt_and_a_reset_within_a_moment_are_noticed(robot: Lockstep):
    fake = fake_of(robot)
    robot.move()
    fake.halt_motors()
    robot.tick()
    fake.reset_motors()  # before the robot has told anybody
    robot.until(lambda: robot.mode() == "tripped", 1.1)
    robot.stays_shut()


@pytest.mark.slow
def test_a_controller_that_is_stopped_trips(robot: Lockstep):
    robot.move()
    assert fake_of(robot).switch(["r_arm_controller"], ["r_cart"])
    robot.until(lambda: robot.mode() == "tripped", 3.0)
    robot.stays_shut()
    assert not robot.ask("reset").accepted


def test_two_controllers_on_the_arm_trip_and_keep_it_from_being_armed(robot: Lockstep):
    fake = fake_of(robot)
    robot.move()
    assert fake.add_rival("r_cart_too")
    robot.trips("r_cart_too also runs on the arm", 5.0)
    reply = robot.ask("reset")
    assert not reply.accepted
    assert any("r_cart_too" in reason for reason in reply.reasons)
    assert fake.switch([], ["r_cart_too"])
    robot.rearm()


@pytest.mark.slow
def test_somebody_else_who_may_command_the_controller_trips(robot: Lockstep):
    fake = fake_of(robot)
    robot.move()
    rival = Node("/rival", fake.master_uri, "127.0.0.1")
    try:
        rival.publish_topic("/r_cart/command_pose", "geometry_msgs/PoseStamped")
        rival.wait_registered(5.0)
        robot.trips("/rival also commands", 20.0)  # it is asked for every five seconds
        assert not robot.ask("reset").accepted
    finally:
        rival.close()


@pytest.mark.slow
def test_a_target_that_is_not_a_number_trips_and_is_told_to_whoever_would_arm(robot: Lockstep):
    fake = fake_of(robot)
    robot.move()
    pose = fake.tool()
    pose[0] = np.nan
    fake._robot.command_pose("r_cart", "torso_lift_link", pose, fake._robot.mechanism.now)
    robot.until(lambda: robot.mode() == "tripped", 0.3)
    robot.rest(2.0)
    assert fake.switch(["r_cart"], ["r_cart"])
    robot.rearm()


@pytest.mark.slow
@pytest.mark.parametrize("topic", ["/r_cart/state", "/joint_states"])
def test_a_state_that_stays_away_trips(robot: Lockstep, topic: str):
    fake = fake_of(robot)
    robot.move()
    fake.mute(topic)
    robot.trips("no state of the robot", 0.2)
    robot.rest(0.3)
    fake.mute()
    robot.stays_shut()
    robot.rearm()


@pytest.mark.slow
def test_a_power_board_that_falls_silent_trips(robot: Lockstep):
    fake = fake_of(robot)
    robot.move()
    fake.mute("/power_board/state")
    robot.trips("power board", 1.3)
    robot.stays_shut()


@pytest.mark.slow
def test_a_robot_whose_computer_stood_still_trips(robot: Lockstep):
    fake = fake_of(robot)
    robot.move()
    fake.freeze()
    robot.trips("no state of the robot", 0.2)
    robot.rest(0.3)
    fake.thaw()
    robot.stays_shut()
    robot.rearm()


@pytest.mark.slow
def test_an_arm_that_is_held_is_not_pushed_harder_than_allowed(robot: Lockstep):
    fake = fake_of(robot)
    robot.move()
    began = robot.clock.now()
    fake.block(True)
    robot.rest(2.0)
    forces = [np.linalg.norm(moment.force[:3]) for moment in fake.moments(began + 0.05)]
    assert 5.0 < max(forces) <= 15.0 + 1e-9


@pytest.mark.slow
def test_an_arm_that_is_dragged_away_trips(robot: Lockstep):
    fake = fake_of(robot)
    robot.move()
    fake.push(0.0, 0.0, -60.0)  # far more than the controller may give
    robot.until(lambda: robot.mode() == "tripped", 1.0)
    fake.push(0.0, 0.0, 0.0)
    robot.rest(3.0)  # it swings back to where it was told to stay
    robot.stays_shut()


@pytest.mark.slow
def test_a_robot_io_that_ends_leaves_the_arm_where_it_is(robot: Lockstep):
    fake = fake_of(robot)
    robot.move()
    robot.service.close()
    count = len(fake.moments())
    for _ in range(300):
        robot.clock.advance(0.01)
        fake.catch_up()
    way = np.array([moment.tool[:3] for moment in fake.moments()[count:]])
    assert extent(way) < 0.05
    assert extent(way[-30:]) < 0.002
