"""What the link makes of a robot's words, without wires."""

import math
from types import SimpleNamespace
from typing import Any

import pytest

from services.robot_io.config import RobotIoConfig
from services.robot_io.pr2.config import Pr2Config
from services.robot_io.pr2.controllers import acts_on, controller_problems
from services.robot_io.pr2.offset import ClockOffset
from services.robot_io.pr2.parameters import parameter_problems
from services.robot_io.pr2.power import Board, Diagnostics, board_problems, motors_problems
from services.robot_io.pr2.restarts import Restarts
from shared.config.site import load_section
from shared.errors import ConfigError
from shared.ros import types
from shared.sim.arm import load_arm

ARM = load_arm("right")
JOINTS = [f"r_{joint.name}_joint" for joint in ARM.joints]
EFFORTS = [joint.effort_limit for joint in ARM.joints]


def parameters(**changed: Any) -> dict[str, Any]:
    found: dict[str, Any] = {
        "cart_gains": {"trans": {"p": 800.0, "d": 15.0}, "rot": {"p": 80.0, "d": 1.2}},
        "pose_command_filter": 0.01,
        "vel_saturation_trans": 1.0,
        "vel_saturation_rot": 4.0,
        "root_name": "torso_lift_link",
        "saturation": dict.fromkeys(JOINTS, 5.0),
    }
    return {**found, **changed}


def judged(found: Any) -> list[str]:
    return parameter_problems(found, Pr2Config(), JOINTS, EFFORTS)


def test_the_limits_are_those_of_the_urdf() -> None:
    assert EFFORTS == [30.0] * 5 + [10.0] * 2
    assert JOINTS[0] == "r_shoulder_pan_joint"


def test_parameters_as_expected_are_no_problem() -> None:
    assert judged(parameters()) == []


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"vel_saturation_trans": 2.0}, "/r_cart/vel_saturation_trans is 2.0, expected 1"),
        ({"vel_saturation_trans": None}, "vel_saturation_trans is not set, expected 1"),
        ({"vel_saturation_trans": math.nan}, "vel_saturation_trans is nan"),
        ({"vel_saturation_rot": True}, "vel_saturation_rot is True"),
        ({"cart_gains": {"trans": {"p": 80.0, "d": 15.0}}}, "cart_gains/trans/p is 80.0"),
        ({"cart_gains": 7}, "cart_gains/rot/d is not set"),
        ({"root_name": "base_link"}, "root_name is base_link, expected torso_lift_link"),
        ({"saturation": {}}, "r_shoulder_pan_joint not set"),
        ({"saturation": dict.fromkeys(JOINTS, 0.0)}, "r_wrist_roll_joint 0.0"),
        ({"saturation": dict.fromkeys(JOINTS, 20.0)}, "r_wrist_flex_joint 20.0"),
    ],
)
def test_a_parameter_that_is_wrong_is_named_with_what_to_do(
    changed: dict[str, Any], said: str
) -> None:
    problems = "\n".join(judged(parameters(**changed)))
    assert said in problems
    assert "load r_cart again" in problems or "expected torso_lift_link" in problems


def test_a_controller_without_parameters_is_said_once() -> None:
    assert judged(None) == ["/r_cart has no parameters: roslaunch the JT controllers"]
    assert len(judged("nonsense")) == 1


@pytest.mark.parametrize(
    ("name", "found", "acts"),
    [
        ("r_arm_controller", {"joints": JOINTS}, True),
        ("l_arm_controller", {"joints": ["l_elbow_flex_joint"]}, False),
        ("r_gripper_controller", {"joint": "r_gripper_joint"}, False),
        ("mine", {"joint": "r_wrist_roll_joint"}, True),
        ("mine", {"joints": [{"name": "r_elbow_flex_joint"}]}, True),
        ("r_cart_2", {"tip_name": "r_gripper_tool_frame"}, True),
        ("l_cart", {"tip_name": "l_gripper_tool_frame"}, False),
        ("r_mystery", None, True),
        ("r_gripper_sensor_controller", {"gain": 1.0}, False),
        ("r_gripper_mystery", {"tip_name": "r_gripper_tool_frame"}, True),
        ("r_mystery", {"gain": 1.0}, True),
        ("head_traj_controller", None, False),
        ("mine", {"joints": 7}, False),
    ],
)
def test_which_controllers_act_on_the_arm(name: str, found: Any, acts: bool) -> None:
    assert acts_on(name, found, JOINTS) is acts


def test_controllers_that_are_wrong_are_named() -> None:
    assert controller_problems("r_cart", {"r_cart": True}, ["r_cart"]) == []
    assert "is not loaded" in controller_problems("r_cart", {}, [])[0]
    assert "is not running" in controller_problems("r_cart", {"r_cart": False}, [])[0]
    both = controller_problems("r_cart", {"r_cart": True, "x": True}, ["r_cart", "x"])
    assert both[0].startswith("x also runs on the arm")


def board(**changed: Any) -> Board:
    message = types.new("pr2_msgs/PowerBoardState", run_stop=True, wireless_stop=True)
    message.circuit_state[:] = 3
    for name, value in changed.items():
        setattr(message, name, value)
    return Board.of(message, 10.0)


def test_the_power_boards_words_are_read_as_the_robot_means_them() -> None:
    assert board_problems(board(), 10.5) == []
    assert not board().is_stopped
    assert board(run_stop=False).is_stopped
    assert "wireless stop is pressed" in board_problems(board(wireless_stop=False), 10.0)[0]
    assert "is disabled" in board_problems(board(circuit_state=[3, 4, 3]), 10.0)[0]
    assert board_problems(board(circuit_state=[4, 3, 4]), 10.0) == []
    assert "silent for 1.5 s" in board_problems(board(), 11.5)[0]
    assert "no word from /power_board/state" in board_problems(None, 0.0)[0]


def test_motors_that_say_nothing_are_a_problem() -> None:
    assert motors_problems(10.0, 12.0) == []
    assert "silent for 4.0 s" in motors_problems(10.0, 14.0)[0]
    assert "no word" in motors_problems(None, 14.0)[0]


def status(name: str, level: int, message: str = "broken") -> Any:
    return SimpleNamespace(name=name, level=level, message=message)


def test_diagnostics_count_while_they_are_errors_and_new() -> None:
    diagnostics = Diagnostics(("Camera",))
    diagnostics.take([status("EtherCAT", 2), status("Camera left", 2), status("Fan", 1)], 10.0)
    assert diagnostics.problems(11.0) == ["diagnostics: EtherCAT: broken"]
    diagnostics.take([status("EtherCAT", 0)], 11.0)
    assert diagnostics.problems(11.0) == []
    diagnostics.take([status(f"Motor {count}", 2) for count in range(5)], 12.0)
    assert diagnostics.problems(12.0)[2] == "diagnostics: 3 more errors"
    assert diagnostics.problems(18.0) == []
    everything = Diagnostics(())
    everything.take([status("Camera left", 2)], 0.0)
    assert everything.problems(0.0) == ["diagnostics: Camera left: broken"]


def test_the_clocks_offset_is_the_least_delay_of_ten_seconds() -> None:
    offset = ClockOffset()
    assert offset.seconds(0.0) is None
    for count in range(300):
        offset.offer(0.1 * count, 0.004 if count == 50 else 0.02 + 0.01 * (count % 3))
        if count == 140:
            assert offset.seconds(14.0) == pytest.approx(0.004)  # seen at 5 s
    assert offset.seconds(30.0) == pytest.approx(0.02)
    offset.offer(30.0, math.nan)
    assert offset.seconds(30.0) == pytest.approx(0.02)
    assert offset.seconds(60.0) is None


HERE = (0.5, 0.0, 0.0)


def watched(*states: tuple[float, float], filtered: float = 0.5) -> Restarts:
    """Return what was seen in states, each a stamp (s) and the x of a target (m)."""
    restarts = Restarts(0.01)
    restarts.sent((0.6, 0.0, 0.0))
    restarts.sent((0.61, 0.0, 0.0))
    before, followed = states[0]
    for stamp, x in states:
        filtered += (1.0 - 0.99 ** (1000.0 * (stamp - before))) * (followed - filtered)
        restarts.observe(stamp, (x, 0.0, 0.0), (filtered, 0.0, 0.0))
        before, followed = stamp, x
    return restarts


def test_targets_that_were_sent_are_no_restart() -> None:
    assert watched((1.0, 0.5), (1.01, 0.5), (1.02, 0.61), (1.03, 0.6), (1.04, 0.6)).generation == 0


def test_a_target_that_was_not_sent_and_stays_is_one_restart() -> None:
    found = watched((1.0, 0.5), (1.01, 0.61), (1.02, 0.58), (1.03, 0.58), (1.04, 0.58))
    assert (found.generation, found.reason) == (1, "its target changed to what was not sent")


def test_one_target_that_is_half_of_two_commands_is_none() -> None:
    assert watched((1.0, 0.5), (1.01, 0.61), (1.02, 0.605), (1.03, 0.6)).generation == 0


def test_another_commander_is_seen_between_our_own_commands() -> None:
    states = [(1.0 + 0.01 * count, 0.6 if count % 2 else 0.3) for count in range(8)]
    assert watched((0.99, 0.6), *states).generation >= 1


def test_a_filtered_target_that_leaps_is_a_restart() -> None:
    restarts = Restarts(0.01)
    target = (0.6, 0.0, 0.0)
    restarts.sent(target)
    x, stamp = 0.5, 1.0
    for _ in range(10):  # as the filter goes: 9.6 % of the way each 10 ms
        restarts.observe(stamp, target, (x, 0.0, 0.0))
        x, stamp = x + 0.096 * (0.6 - x), stamp + 0.01
    assert restarts.generation == 0
    restarts.observe(stamp, target, (x - 0.03, 0.0, 0.0))
    assert (restarts.generation, restarts.reason) == (1, "its filtered target leapt")


@pytest.mark.parametrize("speed", [0.05, 0.29, 0.6])
def test_a_controller_started_anew_under_steady_streaming_is_a_restart(speed: float) -> None:
    restarts = Restarts(0.01)
    lag = 0.034 * speed  # of the tool behind the filtered target: 134 ms less 100 ms
    filtered, stamp = 0.5, 1.0
    for count in range(60):
        target = 0.5 + speed * 0.01 * count
        restarts.sent((target, 0.0, 0.0))
        if count == 50:
            assert restarts.generation == 0
            filtered -= lag  # it begins where the tool is, and the next command follows at once
        restarts.observe(stamp, (target, 0.0, 0.0), (filtered, 0.0, 0.0))
        filtered += (1.0 - 0.99**10) * (target - filtered)
        stamp += 0.01
    assert restarts.generation > 0


def test_a_lost_state_is_no_restart() -> None:
    restarts = Restarts(0.01)
    filtered, stamp = 0.5, 1.0
    for count in range(60):
        target = 0.5 + 0.006 * count
        restarts.sent((target, 0.0, 0.0))
        if count not in (20, 30, 31):
            restarts.observe(stamp, (target, 0.0, 0.0), (filtered, 0.0, 0.0))
        filtered += (1.0 - 0.99**10) * (target - filtered)
        stamp += 0.01
    assert restarts.generation == 0


def test_time_that_jumps_and_silence_are_restarts_a_late_loop_is_none() -> None:
    restarts = Restarts(0.01)
    for count in range(20):
        restarts.observe(1.0 + 0.01 * count, HERE, HERE)
    assert restarts.generation == 0
    restarts.observe(1.5, HERE, HERE)
    assert "silent for 0.31 s" in restarts.reason
    restarts.observe(1.4, HERE, HERE)
    assert "went back" in restarts.reason
    assert restarts.generation == 2


def test_a_target_that_is_not_a_number_is_not_compared() -> None:
    restarts = Restarts(0.01)
    poisoned = (math.nan, 0.0, 0.0)
    for stamp, target in ((1.0, HERE), (1.01, poisoned), (1.02, poisoned), (1.03, HERE)):
        restarts.observe(stamp, target, target)
    assert restarts.generation == 0


@pytest.mark.parametrize(
    ("setting", "said"),
    [
        ("pr2.vel_saturation_trans=3", "vel_saturation_trans is 3; allowed are 0.05 to 2"),
        ("pr2.clock_offset=nan", "clock_offset is nan"),
        ("pr2.kp_trans='stiff'", "kp_trans"),
        ("pr2.master=x", "master"),
    ],
)
def test_settings_that_cannot_be_are_one_line(setting: str, said: str) -> None:
    with pytest.raises(ConfigError, match=said) as found:
        load_section(None, "pr2", Pr2Config, (setting,))
    assert "\n" not in str(found.value)


def test_against_a_pr2_plays_a_person() -> None:
    with pytest.raises(ConfigError, match="tracker may be 'vive', 'mouse' or 'replay'"):
        load_section(None, "robot_io", RobotIoConfig, ("robot_io.link=pr2",))
    asked = ("robot_io.link=pr2", "robot_io.tracker=vive")
    assert load_section(None, "robot_io", RobotIoConfig, asked).link == "pr2"
