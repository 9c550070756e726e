import math
from typing import Any

import pytest

from services.robot_io.gate import disarmed
from services.robot_io.poses import Pose, distance, turned
from tests.unit.robot_io.gates import PERIOD, START, Driven

NAN = Pose((math.nan, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0))


def test_a_gate_begins_disarmed_and_silent():
    driven = Driven().step(50)
    assert driven.memory.mode == "disarmed"
    assert driven.sent == [None] * 50


def test_arming_ramps_and_then_is_armed():
    driven = Driven().step()
    assert driven.arm() == ()
    driven.command = driven.toward(y=0.3)
    driven.step(100)
    assert driven.memory.mode == "ramping"
    assert driven.output.is_clipped
    driven.command = driven.toward(y=0.1)
    driven.step(101)
    assert driven.memory.mode == "armed"


def test_the_ramp_is_slow_at_first():
    driven = Driven().step()
    driven.arm()
    driven.command = driven.toward(y=0.2)
    driven.step(20)
    assert 0.0 < distance(driven.measured.position, START.position) < 0.6 * 0.2 * 0.02


@pytest.mark.parametrize(
    ("changed", "reason"),
    [
        ({"is_run_stopped": True}, "run stop"),
        ({"are_motors_halted": True}, "motors are halted"),
        ({"state_at": 99.0}, "no state of the robot within 0.05 s"),
        ({"tracker_at": 99.0}, "not tracked"),
        ({"is_tracked": False}, "not tracked"),
        ({"speed": 0.03}, "moves at 0.030 m/s, over 0.02"),
        ({"speed": math.nan}, "moves at nan"),
        ({"measured": NAN}, "not a pose"),
        ({"measured": Pose((0.1, 0.0, 0.0), START.orientation)}, "outside its space"),
        ({"problems": ("two controllers on the arm",)}, "two controllers"),
    ],
)
def test_arming_is_refused_with_the_reason(changed: dict[str, Any], reason: str):
    driven = Driven().step()
    memory, reasons = driven.gate.arm(driven.memory, driven.inputs(**changed))
    assert memory.mode == "disarmed"
    assert len(reasons) == 1
    assert reason in reasons[0]


def test_arming_needs_a_policy_that_answers():
    driven = Driven()
    driven.command = None
    driven.step(5)
    assert "no usable command from the policy" in driven.arm()[0]


def test_everything_in_the_way_is_listed_at_once():
    driven = Driven()
    inputs = driven.inputs(is_run_stopped=True, are_motors_halted=True, is_tracked=False)
    _, reasons = driven.gate.arm(driven.memory, inputs)
    assert len(reasons) == 4  # with the policy that has said nothing yet


def test_an_armed_gate_cannot_be_armed_again():
    driven = Driven().armed()
    assert driven.arm() == ("the gate is armed already",)
    assert driven.memory.mode == "armed"


def test_a_silent_policy_makes_it_hold_then_trip():
    driven = Driven().fencing()
    driven.command = None
    driven.step(9)
    assert driven.memory.mode == "armed"
    driven.step(3)
    assert driven.memory.mode == "holding"
    driven.step(45)
    assert (driven.memory.mode, driven.memory.reason) == ("tripped", "no usable command for 0.5 s")


def test_holding_brakes_within_the_braking_distance_and_is_silent_then():
    driven = Driven().fencing()
    driven.command = None
    driven.step(11)
    assert driven.memory.mode == "holding"
    at = driven.measured.position
    driven.step(20)
    assert distance(driven.measured.position, at) <= 0.6**2 / (2 * 6.0)
    assert driven.output.command is None
    assert driven.memory.mode == "holding"


def test_a_held_robot_moves_again_only_after_a_while_of_good_data():
    driven = Driven().fencing()
    driven.step(15, is_tracked=False)
    assert driven.memory.mode == "holding"
    driven.command = driven.toward(y=-0.05)
    driven.step(19)
    assert driven.memory.mode == "holding"
    driven.step(3)
    assert driven.memory.mode == "armed"
    assert driven.output.command is not None


@pytest.mark.parametrize(
    "command",
    [
        NAN,
        Pose((math.inf, 0.0, 0.0), START.orientation),
        Pose(START.position, (0.0, 0.0, 0.0, 0.0)),
        Pose(START.position, (1.1, 0.0, 0.0, 0.0)),
        Pose(START.position, (math.nan, 0.0, 0.0, 0.0)),
        Pose((5.0, 0.0, 0.0), START.orientation),
    ],
)
def test_a_command_that_cannot_be_used_holds_and_ten_in_a_row_trip(command: Pose):
    driven = Driven().armed()
    driven.command = command
    driven.step()
    assert driven.memory.mode == "holding"
    driven.step(8)
    assert driven.memory.mode == "holding"
    driven.step()
    assert driven.memory.mode == "tripped"
    assert "10 unusable" in driven.memory.reason


def test_one_bad_command_is_forgiven():
    driven = Driven().armed()
    driven.command = NAN
    driven.step()
    driven.command = driven.toward(y=0.02)
    driven.step(25)
    assert driven.memory.mode == "armed"


@pytest.mark.parametrize(
    ("changed", "ticks", "reason"),
    [
        ({"is_run_stopped": True}, 1, "run stop"),
        ({"are_motors_halted": True}, 1, "motors"),
        ({"generation": 1}, 1, "restarted"),
        ({"problems": ("two controllers on the arm",)}, 1, "two controllers"),
        ({"state_at": 0.0}, 1, "no state"),
        ({"force": 41.0}, 7, "40 N"),
        ({"force": math.nan}, 7, "40 N"),
        ({"effort_share": 0.9}, 12, "effort"),
        ({"measured": NAN}, 10, "unusable"),
    ],
)
def test_a_fault_trips_and_stays(changed: dict[str, Any], ticks: int, reason: str):
    driven = Driven().armed()
    driven.step(ticks, **changed)
    assert driven.memory.mode == "tripped"
    assert reason in driven.memory.reason
    silent_from = len(driven.sent)
    driven.step(300)
    assert driven.memory.mode == "tripped"
    assert driven.sent[silent_from:] == [None] * 300


def test_a_short_force_does_not_trip():
    driven = Driven().armed()
    driven.step(4, force=80.0)
    driven.step(2, force=10.0)
    driven.step(4, force=80.0)
    assert driven.memory.mode == "armed"


def test_a_tool_that_does_not_follow_trips():
    driven = Driven().armed()
    away = driven.toward(x=0.2)
    driven.step(19, measured=away)
    assert driven.memory.mode == "armed"
    driven.step(4, measured=away)
    assert driven.memory.mode == "tripped"
    assert "0.15 m from its command" in driven.memory.reason


def test_a_stale_state_holds_before_it_trips():
    driven = Driven().armed()
    driven.step(1, state_at=driven.now - 0.05)
    assert driven.memory.mode == "holding"


def test_after_the_run_stop_nothing_moves_until_reset_and_armed_by_a_person():
    driven = Driven().fencing()
    driven.step(1, is_run_stopped=True)
    driven.command = driven.toward(y=0.1)
    driven.step(500)  # released, and the policy streams on
    assert driven.memory.mode == "tripped"
    assert set(driven.sent[-500:]) == {None}
    assert "has tripped (the run stop was pressed): reset it first" in driven.arm()[0]
    driven.memory, reasons = driven.gate.reset(driven.memory, driven.inputs(is_run_stopped=True))
    assert reasons == ("the run stop is pressed",)
    driven.memory, reasons = driven.gate.reset(driven.memory, driven.inputs())
    assert reasons == ()
    driven.step(100)
    assert driven.memory.mode == "disarmed"
    assert set(driven.sent[-100:]) == {None}
    assert driven.arm() == ()
    assert driven.step().memory.mode == "ramping"


def test_only_a_trip_can_be_reset():
    driven = Driven().armed()
    _, reasons = driven.gate.reset(driven.memory, driven.inputs())
    assert reasons == ("the gate is armed, there is nothing to reset",)


def test_disarming_is_silent_at_once():
    driven = Driven().fencing()
    driven.memory = disarmed(driven.memory, "as asked")
    assert driven.step(5).memory.mode == "disarmed"
    assert driven.sent[-5:] == [None] * 5


def test_between_bouts_it_goes_at_warm_up_speed():
    driven = Driven().armed()
    before = driven.measured.position
    for _ in range(50):
        driven.command = driven.toward(y=0.1)
        driven.step(is_home=True)
    assert distance(driven.measured.position, before) <= 50 * PERIOD * 0.25 + 1e-9


def test_a_command_out_of_the_box_ends_on_its_wall():
    driven = Driven().armed()
    for _ in range(300):
        driven.command = driven.toward(x=-0.29)
        driven.step()
    assert driven.measured.position[0] == pytest.approx(0.35, abs=1e-6)
    assert driven.output.is_clipped


def test_a_bat_does_not_go_above_the_ceiling():
    driven = Driven(ceiling=0.6).armed()
    for _ in range(300):
        driven.command = driven.toward(z=0.1)
        driven.step()
    tip = driven.measured.position[2] + 0.7 * math.sqrt(0.5)
    assert tip == pytest.approx(0.6 - 0.025, abs=1e-6)


@pytest.mark.parametrize("lean", [0.1, -0.1])
def test_a_bat_under_the_ceiling_reaches_another_place_under_it(lean: float):
    driven = Driven(ceiling=0.6).armed()
    driven.command = driven.toward(z=0.2)
    driven.step(200)
    leant = turned(driven.measured.orientation, (0.0, lean, 0.0))
    driven.command = Pose(driven.toward(x=0.05, z=0.1).position, leant)
    goal = driven.gate.space.nearest(driven.command)
    driven.step(200)
    assert driven.gate.space.clearance(goal) == pytest.approx(0.0, abs=1e-9)
    assert driven.measured.position == pytest.approx(goal.position, abs=1e-4)
    assert driven.measured.orientation == pytest.approx(goal.orientation, abs=1e-4)


def test_a_bat_stays_out_of_the_place_where_the_person_stands():
    driven = Driven(keep_out=(1.4, -0.25), keep_out_radius=0.2).armed()
    for _ in range(300):
        driven.command = driven.toward(x=0.1)
        driven.step()
    tip = driven.measured.position[0] + 0.7 * math.sqrt(0.5)
    assert tip == pytest.approx(1.4 - 0.2 - 0.025, abs=1e-3)


def test_a_blocked_tool_is_never_led_further_than_the_limit():
    driven = Driven().armed()
    blocked = driven.measured
    for _ in range(30):
        driven.command = Pose((0.553, 0.0, 0.0), START.orientation)
        driven.step(measured=blocked)
        assert driven.output.command is not None
        assert distance(driven.output.command.position, blocked.position) <= 0.12 + 1e-9
    assert driven.memory.mode == "armed"
