"""Scoreboards over the course of bouts, and the phases of a live one."""

import numpy as np
import pytest

from shared.game.bout import Event, Phase, Scoreboard, next_phase
from shared.game.geometry import BatShape, Target
from shared.game.rules import RuleBook

IDENTITY = np.array([1.0, 0.0, 0.0, 0.0])
TARGET = Target((0.0, 0.0, 0.0), 0.2)


def board(worlds: int = 1, **rules: int) -> Scoreboard:
    return Scoreboard(worlds, RuleBook(**rules), BatShape(), TARGET)


def judge(scores: Scoreboard, antagonist: float, protagonist: float) -> float:
    """Judge one step with both bats along x, at these heights over the target's centre."""
    worlds = len(scores.score)
    grips = np.zeros((3, 2, worlds))
    grips[0] = -0.3
    grips[2, 0], grips[2, 1] = antagonist, protagonist
    quaternions = np.broadcast_to(IDENTITY[:, None, None], (4, 2, worlds))
    return float(scores.judge(grips, quaternions).points[0])


def test_a_bout_adds_up_its_points_by_rule():
    scores = board(camping_steps=2)
    given = [
        judge(scores, 0.0, 1.0),
        judge(scores, 0.0, 0.04),
        judge(scores, 1.0, 0.0),
        judge(scores, 1.0, 0.0),
    ]
    assert given == [1.0, -10.0, 0.0, 10.0]
    assert scores.score[0] == 1.0
    assert (scores.attack_steps[0], scores.penalty_steps[0], scores.camping_steps[0]) == (1, 1, 1)


def test_a_bout_is_finished_after_its_steps_and_not_before():
    scores = board(bout_steps=3)
    finished = []
    for _ in range(3):
        judge(scores, 1.0, 1.0)
        finished.append(bool(scores.finished()[0]))
    assert finished == [False, False, True]


def test_a_reset_forgets_one_bout_and_leaves_the_others():
    scores = board(3, camping_steps=1)
    for _ in range(4):
        judge(scores, 0.0, 0.0)
    before = scores.state()
    scores.reset(np.array([1]), np.array([40], np.int32))
    assert scores.step.tolist() == [4, 40, 4]
    for name in ("camping", "score", "attack_steps", "penalty_steps", "camping_steps"):
        values = getattr(scores, name)
        assert values[1] == 0
        assert values[[0, 2]].tolist() == before[name][[0, 2]].tolist()


def test_a_restored_scoreboard_goes_on_as_the_one_it_was_taken_from():
    scores = board(2, camping_steps=2)
    for _ in range(3):
        judge(scores, 0.0, 0.0)
    other = board(2, camping_steps=2)
    other.restore(scores.state())
    assert judge(other, 0.0, 0.0) == judge(scores, 0.0, 0.0)
    for name, value in scores.state().items():
        np.testing.assert_array_equal(other.state()[name], value)


def test_a_state_is_a_copy():
    scores = board()
    state = scores.state()
    judge(scores, 0.0, 1.0)
    assert state["step"][0] == 0
    assert state["score"][0] == 0.0


def test_a_live_bout_runs_from_ready_through_a_pause_to_its_end():
    phase = Phase.READY
    for event, expected in [
        (Event.START, Phase.RUNNING),
        (Event.PAUSE, Phase.PAUSED),
        (Event.RESUME, Phase.RUNNING),
        (Event.TIME_UP, Phase.FINISHED),
    ]:
        phase = next_phase(phase, event)
        assert phase is expected


@pytest.mark.parametrize("phase", [Phase.READY, Phase.RUNNING, Phase.PAUSED])
def test_a_bout_that_is_not_over_can_be_abandoned(phase: Phase):
    assert next_phase(phase, Event.ABANDON) is Phase.VOID


@pytest.mark.parametrize("phase", [Phase.FINISHED, Phase.VOID])
@pytest.mark.parametrize("event", list(Event))
def test_nothing_happens_to_a_bout_that_is_over(phase: Phase, event: Event):
    with pytest.raises(ValueError, match=rf"{phase.value} cannot {event.value}; possible: none"):
        next_phase(phase, event)


def test_an_event_out_of_turn_is_refused_with_those_in_turn():
    with pytest.raises(ValueError, match="ready cannot resume; possible: start, abandon"):
        next_phase(Phase.READY, Event.RESUME)
    with pytest.raises(ValueError, match="paused cannot time_up"):
        next_phase(Phase.PAUSED, Event.TIME_UP)
