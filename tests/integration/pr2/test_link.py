"""The link to a PR2 over a real ROS master, and what it makes of each word of the robot's."""

import contextlib
import math
import time
from collections.abc import Callable, Iterator

import numpy as np
import pytest

from services.robot_io.links import RobotState
from services.robot_io.pr2 import link as link_module
from services.robot_io.pr2 import watch
from services.robot_io.pr2.config import Pr2Config
from services.robot_io.pr2.link import Pr2Link
from services.robot_io.pr2.state import BatFrame
from services.robot_io.vive.frames import heading
from shared.clock import SystemClock
from shared.ros.node import Node
from shared.sim.arm import load_arm
from shared.testing.ros_master import has_ros_master
from tests.integration.pr2.small_robot import JOINTS, SmallRobot

pytestmark = pytest.mark.skipif(
    not has_ros_master(), reason="needs Debian's ROS master: apt install python3-rosmaster"
)
TORSO = heading((-1.0, 0.0, 0.8), 0.0)
EFFORTS = [joint.effort_limit for joint in load_arm("right").joints]
POSE = np.array([0.61, 0.02, 0.03, 1.0, 0.0, 0.0, 0.0])


def connect(uri: str, **settings: float) -> Pr2Link:
    cfg = Pr2Config(master_uri=uri, **settings)  # type: ignore[arg-type]
    return Pr2Link(cfg, BatFrame(TORSO, (1.0, 0.0, 0.0, 0.0)), JOINTS, EFFORTS, SystemClock())


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(watch, "POLL_SECONDS", 0.1)
    monkeypatch.setattr(watch, "GRAPH_POLLS", 1)
    monkeypatch.setattr(watch, "SERVICE_SECONDS", 0.3)
    monkeypatch.setattr(link_module, "LISTED_SECONDS", 0.6)
    monkeypatch.setattr(link_module, "MASTER_SECONDS", 0.6)


@pytest.fixture
def robot(quick: None) -> Iterator[SmallRobot]:
    with contextlib.closing(SmallRobot()) as found:
        yield found


@pytest.fixture
def link(robot: SmallRobot) -> Iterator[Pr2Link]:
    with contextlib.closing(connect(robot.master.uri, clock_offset=0.05)) as found:
        until(found, lambda state: not state.problems)
        yield found


def until(
    link: Pr2Link, holds: Callable[[RobotState], object], seconds: float = 10.0
) -> RobotState:
    """Read on until something holds of the state."""
    deadline = time.monotonic() + seconds
    while not holds(state := link.read(time.monotonic())):
        assert time.monotonic() < deadline, f"not in time; problems are {state.problems}"
        time.sleep(0.005)
    return state


def until_problem(link: Pr2Link, words: str) -> RobotState:
    return until(link, lambda state: any(words in problem for problem in state.problems))


def test_a_robot_in_order_is_read_as_it_says(robot: SmallRobot, link: Pr2Link) -> None:
    robot.state.xd.linear.x = 0.3
    robot.state.F.force.z = -12.0
    robot.joints.effort[3] = -15.0
    state = until(link, lambda state: state.force == 12.0 and state.effort_share == 0.5)
    assert state.tool.tolist() == [0.6, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]
    assert state.speed == pytest.approx(0.3)
    assert state.bat.tolist() == pytest.approx([-0.4, 0, 0.8, 1, 0, 0, 0, 0.3, 0, 0, 0, 0, 0])
    assert state.joints.tolist() == [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]
    assert time.monotonic() - state.at < 1.0
    assert not state.is_run_stopped
    assert not state.are_motors_halted
    assert "r_cart runs, alone on the arm" in state.passed
    assert any("the robot's clock is" in words for words in state.passed)


def test_a_command_arrives_as_it_was_let_through(robot: SmallRobot, link: Pr2Link) -> None:
    assert robot.commands.received == 0
    link.write(POSE)
    assert robot.commands.wait(5.0)
    found = robot.commands.take()
    assert found is not None
    message = found.message
    place, turn = message.pose.position, message.pose.orientation
    assert [place.x, place.y, place.z, turn.w, turn.x, turn.y, turn.z] == POSE.tolist()
    assert message.header.frame_id == "torso_lift_link"


def test_it_holds_once_and_only_what_was_commanded(robot: SmallRobot, link: Pr2Link) -> None:
    link.hold()
    link.write(POSE)
    link.hold()
    link.hold()
    until_problem(link, "being told to stay")
    state = until(link, lambda state: not state.problems)
    assert [(one.start_controllers, one.stop_controllers) for one in robot.switched] == [
        (["r_cart"], [])
    ]
    assert robot.switched[0].strictness == 2
    assert state.generation >= 1  # what the gate knew of the target is void


def test_a_controller_that_is_stopped_is_not_started_to_hold(
    robot: SmallRobot, link: Pr2Link
) -> None:
    link.write(POSE)
    robot.running.update(r_cart=False, r_arm_controller=True)
    state = until_problem(link, "the controller r_cart is not running")
    assert any("r_arm_controller also runs" in problem for problem in state.problems)
    link.hold()
    time.sleep(0.3)
    assert robot.switched == []
    robot.running.update(r_cart=True, r_arm_controller=False)
    assert until(link, lambda state: not state.problems).generation >= 1


def test_an_order_to_hold_is_repeated_until_it_is_heard(robot: SmallRobot, link: Pr2Link) -> None:
    link.write(POSE)
    robot.is_refusing = True
    link.hold()
    until_problem(link, "r_cart could not be told to hold")
    until_problem(link, "the manager is out of order")
    robot.is_refusing = False
    until(link, lambda state: not state.problems)
    assert len(robot.switched) == 1


def test_stops_power_and_motors_are_told_apart(robot: SmallRobot, link: Pr2Link) -> None:
    robot.board.run_stop = False
    until(link, lambda state: state.is_run_stopped)
    robot.board.run_stop = True
    state = until(link, lambda state: not state.is_run_stopped)
    assert state.generation >= 1  # the controllers restart with the motors
    robot.board.wireless_stop = False
    until_problem(link, "the wireless stop is pressed")
    robot.board.wireless_stop = True
    robot.board.circuit_state[1] = 4
    until_problem(link, "the right arm's circuit is disabled")
    robot.board.circuit_state[1] = 3
    robot.halted.data = True
    until(link, lambda state: state.are_motors_halted)
    robot.halted.data = False
    robot.muted.add("board")
    until_problem(link, "the power board was silent")


def test_a_restart_another_commander_and_a_poisoned_target_are_seen(
    robot: SmallRobot, link: Pr2Link
) -> None:
    robot.relatch()
    until(link, lambda state: state.generation >= 1)
    with Node("/rival", robot.master.uri) as rival:
        rival.publish_topic("/r_cart/command_pose", "geometry_msgs/PoseStamped")
        until_problem(link, "/rival also commands /r_cart")
    until(link, lambda state: not state.problems)
    robot.state.x_desi_filtered.pose.position.x = math.nan
    until_problem(link, "the target of r_cart is not a number")
    robot.state.x_desi_filtered.pose.position.x = 0.6
    robot.state.x.pose.position.y = math.nan
    state = until_problem(link, "pose or speed is not a number")
    assert np.isfinite(state.tool).all()
    assert state.at < link.read(time.monotonic() + 1.0).at + 0.1


def test_states_that_stay_away_grow_old(robot: SmallRobot, link: Pr2Link) -> None:
    robot.muted.add("joints")
    until(link, lambda state: time.monotonic() - state.at > 0.2)
    robot.muted.clear()
    until(link, lambda state: time.monotonic() - state.at < 0.1)
    robot.muted.add("state")
    until(link, lambda state: time.monotonic() - state.at > 0.3)
    robot.muted.clear()
    until(link, lambda state: state.generation >= 1)  # a controller that was silent


def test_clocks_diagnostics_and_parameters_that_are_wrong(robot: SmallRobot, link: Pr2Link) -> None:
    robot.status.level, robot.status.message = 2, "a motor is too hot"
    until_problem(link, "diagnostics: EtherCAT Master: a motor is too hot")
    robot.status.level = 0
    robot.node.set_param("/r_cart/vel_saturation_trans", 2.0)
    until_problem(link, "/r_cart/vel_saturation_trans is 2.0, expected 1")
    robot.node.set_param("/r_cart/vel_saturation_trans", 1.0)
    until(link, lambda state: not state.problems)
    robot.offset_ns = 500_000_000  # ahead of ours: the least delay is then below zero
    state = until_problem(link, "the robot's clock is -")
    assert state.generation >= 1


def test_the_loop_waits_for_nobody(robot: SmallRobot, link: Pr2Link) -> None:
    robot.delay = 3.0  # of a manager that hangs
    link.write(POSE)
    link.hold()
    times: list[float] = []
    for _ in range(100):
        began = time.thread_time()
        link.read(time.monotonic())
        link.write(POSE)
        times.append(time.thread_time() - began)
        time.sleep(0.002)
    assert float(np.median(times)) < 0.002
    until_problem(link, "no answer within 0.3 s")
    robot.delay = 0.0


def test_no_master_is_one_line_and_the_robot_may_come_later(quick: None) -> None:
    with contextlib.closing(SmallRobot()) as gone:
        uri = gone.master.uri
    with contextlib.closing(connect(uri)) as link:
        state = until_problem(link, f"no ROS master at {uri}")
        assert len(state.problems) == 1
        assert state.at == -math.inf
        assert np.isfinite(state.tool).all()
        began = time.monotonic()
    assert time.monotonic() - began < 5.0


def test_a_master_that_goes_is_a_problem_and_the_state_still_comes(
    robot: SmallRobot, link: Pr2Link
) -> None:
    robot.master.close()
    state = until_problem(link, "no ROS master at")
    assert time.monotonic() - state.at < 1.0
    link.write(POSE)
    assert robot.commands.wait(2.0)
    link.hold()  # the manager is found without the master
    deadline = time.monotonic() + 5.0
    while not robot.switched:
        assert time.monotonic() < deadline
        time.sleep(0.01)
