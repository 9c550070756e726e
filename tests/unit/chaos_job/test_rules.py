"""What the watcher calls a command outside the gate's rules."""

import math

import numpy as np
import pytest

from services.jobs.chaos.robot.rules import Bat, Rules
from services.robot_io.config import SafetyConfig
from services.robot_io.gate import Gate, GateInputs, GateMemory
from services.robot_io.limits import Blade
from services.robot_io.poses import Pose, array_of
from shared.messages.play import GateMode, GateState
from shared.sim.config import SimConfig

INSIDE = (0.6, 0.0, 0.0)
LIMITS = SafetyConfig()
LEVEL = (1.0, 0.0, 0.0, 0.0)
Triple = tuple[float, float, float]


def gate(
    tick: int, mode: GateMode = "armed", place: Triple = INSIDE, *, turn: float = 0.0,
    up: float = 0.0, is_sent: bool = True,
) -> GateState:  # fmt: skip
    """A state whose bat is turned to the side, or raised (rad)."""
    half = 0.5 * (turn or up)
    axis = (0.0, 0.0, 1.0) if turn else (0.0, -1.0, 0.0)
    pose = [*place, math.cos(half), *(math.sin(half) * number for number in axis)]
    return GateState(
        tick=tick, mode=mode, commanded=np.array(pose), is_clipped=False, is_sent=is_sent,
        lateness_ms=0.0, late_ticks=0,
    )  # fmt: skip


@pytest.fixture
def rules() -> Rules:
    return Rules(LIMITS, Bat(np.array([[-0.1, 0.0, 0.0], [0.8, 0.0, 0.0]]), 0.02))


def broken_by(rules: Rules, *states: GateState) -> list[str]:
    return [found for state in states if (found := rules.broken_by(state))]


def test_commands_that_speed_up_and_slow_down_as_they_may_break_nothing(rules: Rules):
    step = LIMITS.acceleration * 0.01
    speeds = [min(step * tick, LIMITS.game_speed, step * (40 - tick)) for tick in range(41)]
    places = np.cumsum(speeds) * 0.01
    states = [gate(tick, place=(0.6, place, 0.0)) for tick, place in enumerate(places)]
    assert broken_by(rules, *states) == []
    assert (rules.checked, rules.accelerations) == (41, 39)


def test_a_command_outside_the_box_is_seen(rules: Rules):
    assert rules.broken_by(gate(0, place=(1.2, 0.0, 0.0))) == "outside the box"


def test_a_bat_above_the_ceiling_is_seen(rules: Rules):
    high = (0.6, 0.0, 0.5)
    assert rules.broken_by(gate(0, place=high)) == ""
    assert rules.broken_by(gate(100, place=high, up=0.6)) == "bat above the ceiling"


def test_a_bat_where_the_person_stands_is_seen(rules: Rules):
    near = (0.9, 0.0, 0.0)
    assert rules.broken_by(gate(0, place=near)) == "bat where the person stands"
    assert rules.broken_by(gate(100, place=near, turn=1.2)) == ""


def test_the_middle_of_a_bat_may_not_be_there_either():
    across = Bat(np.array([[0.0, -0.5, 0.0], [0.0, 0.5, 0.0]]), 0.02)
    rules = Rules(SafetyConfig(keep_out=(0.8, 0.0), keep_out_radius=0.1), across)
    assert rules.broken_by(gate(0, place=(0.75, 0.0, 0.0))) == "bat where the person stands"


def test_a_command_that_is_no_number_is_seen(rules: Rules):
    assert rules.broken_by(gate(0, place=(np.nan, 0.0, 0.0))) == "sent what is no number"


def test_a_command_that_jumps_is_seen(rules: Rules):
    assert broken_by(rules, gate(0), gate(1, place=(0.61, 0.0, 0.0))) == ["over the game speed"]


def test_a_command_that_turns_too_fast_is_seen(rules: Rules):
    step = LIMITS.turn_speed * 0.01
    assert broken_by(rules, gate(0), gate(1, turn=1.1 * step)) == ["over the turn speed"]


def test_a_command_that_sets_off_or_turns_about_too_suddenly_is_seen(rules: Rules):
    way = LIMITS.game_speed * 0.01
    states = [gate(tick, place=(0.6, way * (tick == 2), 0.0)) for tick in range(4)]
    assert broken_by(rules, *states) == 2 * ["over the acceleration"]


def test_a_command_that_begins_to_turn_too_suddenly_is_seen(rules: Rules):
    turn = LIMITS.turn_speed * 0.01
    states = [gate(tick, turn=turn * (tick == 2)) for tick in range(3)]
    assert broken_by(rules, *states) == ["over the turn acceleration"]


def test_ticks_that_were_not_heard_say_nothing_of_the_acceleration(rules: Rules):
    way = LIMITS.game_speed * 0.02
    assert broken_by(rules, gate(0), gate(1), gate(3, place=(0.6, way, 0.0))) == []
    assert rules.accelerations == 0


@pytest.mark.parametrize("mode", ["disarmed", "tripped"])
def test_a_command_of_a_shut_gate_is_seen(rules: Rules, mode: GateMode):
    assert rules.broken_by(gate(0, mode)) == f"sent while {mode}"
    assert not rules.broken_by(gate(1, mode, is_sent=False))


def test_a_gate_that_opens_by_itself_after_a_trip_is_seen(rules: Rules):
    states = (gate(0), gate(1, "tripped", is_sent=False), gate(2, "ramping"))
    assert broken_by(rules, *states) == ["sent after it was shut, and nobody armed it"]


def test_a_person_may_open_it(rules: Rules):
    rules.broken_by(gate(0))
    rules.broken_by(gate(1, "tripped", is_sent=False))
    rules.note_arming(may_open=True)
    assert not rules.broken_by(gate(2, "ramping"))


def test_a_person_who_was_refused_has_not_opened_it(rules: Rules):
    rules.broken_by(gate(0, "tripped", is_sent=False))
    rules.note_arming(may_open=True)
    rules.note_arming(may_open=False)
    assert rules.broken_by(gate(1, "ramping"))


def test_what_the_gate_makes_of_wild_commands_breaks_nothing_and_is_looked_at():
    bat = Bat.of(SimConfig())
    rules = Rules(LIMITS, bat)
    along = bat.ends[1] / np.linalg.norm(bat.ends[1])
    blade = Blade(
        (float(along[0]), float(along[1]), float(along[2])), float(np.linalg.norm(bat.ends[1])),
        -float(np.linalg.norm(bat.ends[0])), bat.radius,
    )  # fmt: skip
    real = Gate(LIMITS, blade, 0.01)
    rng = np.random.default_rng(0)
    memory, tool, wanted = GateMemory(), Pose(INSIDE, LEVEL), Pose(INSIDE, LEVEL)
    for tick in range(3000):
        if tick % 7 == 0:
            spin = rng.normal(size=4) * 0.3 + LEVEL
            off = 0.15 * rng.uniform(-1.0, 1.0, 3)
            x, y, z = (float(number) for number in np.array(tool.position) + off)
            four = [float(number) for number in spin / np.linalg.norm(spin)]
            wanted = Pose((x, y, z), (four[0], four[1], four[2], four[3]))
        inputs = GateInputs(
            now=0.01 * tick, measured=tool, state_at=0.01 * tick, speed=0.0, command=wanted,
            tracker_at=0.01 * tick, is_tracked=True,
        )  # fmt: skip
        if tick == 1:
            memory, reasons = real.arm(memory, inputs)
            assert not reasons
        memory, output = real.step(memory, inputs)
        tool = output.command or tool
        state = GateState(
            tick=tick, mode=memory.mode, commanded=array_of(tool), is_clipped=output.is_clipped,
            is_sent=output.command is not None, lateness_ms=0.0, late_ticks=0,
        )  # fmt: skip
        assert rules.broken_by(state) == ""
    assert rules.accelerations > 2000
