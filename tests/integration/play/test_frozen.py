"""A process that the machine holds up, for as long as it likes, and lets go on."""

import signal
from pathlib import Path

import numpy as np
import pytest

from shared.messages.topics import BATS
from tests.integration.play.conftest import Stage
from tests.integration.play.test_bout import PATIENT, verdict

pytestmark = pytest.mark.zenoh

LONG_TICKS = 150
SHORT_TICKS = 25


def test_a_policy_that_was_held_up_answers_nothing_of_the_time_between(stage: Stage):
    stage.start("policy", agent="protagonist")
    bats = stage.bus.subscribe(BATS)
    newest = -1

    def reaches(tick: int) -> bool:
        nonlocal newest
        while (states := bats.take()) is not None:
            newest = states.tick
        return newest >= tick

    stage.publish()
    stage.until(lambda: reaches(0) and stage.offsets)
    stage.send_signal("policy", signal.SIGSTOP)
    stopped = newest
    stage.until(lambda: reaches(stopped + LONG_TICKS))
    stage.send_signal("policy", signal.SIGCONT)
    woken = newest
    stage.until(lambda: stage.offsets[-1].tick > woken + 20)
    answered = {offset.tick for offset in stage.offsets}
    # What it had before, and what is fresh; ten ticks are what it may take for fresh.
    assert not answered & set(range(stopped + 50, woken - 20))
    assert sorted(answered) == [offset.tick for offset in stage.offsets]


def test_a_referee_that_was_held_up_judges_every_tick_all_the_same(
    stage: Stage, recorded: tuple[Path, dict[str, float]]
):
    stage.start("referee", *PATIENT)
    bats = stage.bus.subscribe(BATS)
    stage.publish()
    stage.begin("one")
    stage.until(lambda: stage.seen[-1].step > 20)
    stage.send_signal("referee", signal.SIGSTOP)
    while bats.take() is not None:
        pass
    seen: list[int] = []
    stage.until(
        lambda: (
            (states := bats.take()) is not None
            and not seen.append(states.tick)
            and len(seen) >= SHORT_TICKS
        )
    )
    step = stage.seen[-1].step
    stage.send_signal("referee", signal.SIGCONT)
    assert verdict(stage, "one") == recorded[1]
    steps = np.array([state.step for state in stage.seen if state.step])
    assert (np.diff(steps) >= 0).all()
    assert step < steps[-1] - SHORT_TICKS
