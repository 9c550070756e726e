"""What the watcher calls a command outside the gate's rules."""

import numpy as np
import pytest

from services.jobs.chaos.rules import Rules
from services.robot_io.config import SafetyConfig
from shared.messages.play import GateMode, GateState

INSIDE = (0.6, 0.0, 0.0)


def gate(
    tick: int, mode: GateMode = "armed", place: tuple[float, float, float] = INSIDE, *,
    is_sent: bool = True,
) -> GateState:  # fmt: skip
    return GateState(
        tick=tick, mode=mode, commanded=np.array([*place, 1.0, 0.0, 0.0, 0.0]), is_clipped=False,
        is_sent=is_sent, lateness_ms=0.0, late_ticks=0,
    )  # fmt: skip


@pytest.fixture
def rules() -> Rules:
    return Rules(SafetyConfig())


def test_commands_in_the_box_at_game_speed_break_nothing(rules: Rules):
    step = SafetyConfig().game_speed * 0.01
    states = [gate(tick, place=(0.6 + step * tick, 0.0, 0.0)) for tick in range(20)]
    assert not any(rules.broken_by(state) for state in states)
    assert rules.checked == 20


def test_a_command_outside_the_box_is_seen(rules: Rules):
    assert rules.broken_by(gate(0, place=(1.2, 0.0, 0.0)))


def test_a_command_that_is_no_number_is_seen(rules: Rules):
    assert rules.broken_by(gate(0, place=(np.nan, 0.0, 0.0)))


def test_a_command_that_jumps_is_seen(rules: Rules):
    rules.broken_by(gate(0))
    assert rules.broken_by(gate(1, place=(0.61, 0.0, 0.0)))


@pytest.mark.parametrize("mode", ["disarmed", "tripped"])
def test_a_command_of_a_shut_gate_is_seen(rules: Rules, mode: GateMode):
    assert rules.broken_by(gate(0, mode))
    assert not rules.broken_by(gate(1, mode, is_sent=False))


def test_a_gate_that_opens_by_itself_after_a_trip_is_seen(rules: Rules):
    rules.broken_by(gate(0))
    rules.broken_by(gate(1, "tripped", is_sent=False))
    assert rules.broken_by(gate(2, "ramping"))


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
