"""The referee's verdict on what an actor played is the actor's own score, to the last bit."""

import functools
import itertools

import numpy as np
import pytest

from services.referee.config import RefereeConfig
from services.referee.service import Referee
from shared.bus.memory import MemoryHub
from shared.clock import ManualClock
from shared.game.bout import Scoreboard
from shared.game.live import judge_states
from shared.game.rules import RuleBook
from shared.messages.play import BatStates, PlayReply, PlayRequest, RefereeState
from shared.messages.topics import BATS, BOUT, REFEREE
from shared.sim.arena import bat_of, target_of
from shared.sim.config import SimConfig
from tests.replay.recorded import RecordedBouts, play

RULES = RuleBook(bout_steps=200, camping_steps=30)
PAIRS = tuple(
    itertools.product(
        ("stab", "slash", "person-novice"), ("static", "heuristic", "guard")
    )
)  # fmt: skip
BOUTS = 120
"""Of each pair; 1,080 in all."""
COUNTERS = ("score", "attack_steps", "penalty_steps", "camping_steps")


def board(bouts: int = 1) -> Scoreboard:
    return Scoreboard(bouts, RULES, bat_of(SimConfig()), target_of(SimConfig()))


@pytest.fixture(scope="module")
def recorded() -> list[RecordedBouts]:
    return [play(*pair, RULES, BOUTS, seed) for seed, pair in enumerate(PAIRS)]


def test_the_verdict_on_a_thousand_recorded_bouts_is_the_actors(recorded: list[RecordedBouts]):
    verdicts = 0
    for bouts in recorded:
        scores = board(BOUTS)
        for bats in bouts.bats:
            judge_states(scores, bats)
        for name in COUNTERS:
            np.testing.assert_array_equal(getattr(scores, name), getattr(bouts.results, name))
        assert scores.finished().all()
        verdicts += BOUTS
    assert verdicts >= 1000


def test_the_recorded_bouts_have_everything_the_rules_speak_of(recorded: list[RecordedBouts]):
    for name in COUNTERS:
        values = np.concatenate([getattr(bouts.results, name) for bouts in recorded])
        assert (values != 0).sum() >= 20, name
        assert len(np.unique(values)) >= 10, name


class Table:
    """A referee with somebody who brings it the states of whole bouts, over a bus."""

    def __init__(self) -> None:
        self.clock = ManualClock()
        hub = MemoryHub(self.clock)
        cfg = RefereeConfig()
        judge = functools.partial(board, 1)
        self.bus = hub.join("robot_io")
        self.referee = Referee(cfg, judge, 0.01, hub.join("referee"), self.clock)
        self.states = self.bus.subscribe(REFEREE)
        self.tick = 0

    def bring(self, bats: np.ndarray) -> None:
        self.bus.publish(
            BATS,
            BatStates(
                tick=self.tick, boot="b", at_ns=self.clock.wall_ns(), bats=bats,
                tools=np.zeros((2, 7)), is_valid=np.ones(2, np.bool_), seconds=0.0,
            ),
        )  # fmt: skip
        self.tick += 1
        self.clock.advance(0.01)
        self.referee.tick()

    def verdict(self, bouts: RecordedBouts, world: int, name: str) -> RefereeState:
        for _ in range(25):
            self.bring(bouts.first[world])
        asked = PlayRequest(action="start", bout=name, antagonist="a", protagonist="p")
        answer = self.bus.ask(BOUT, asked, 1.0)
        self.referee.tick()
        assert answer.take() == PlayReply(accepted=True, phase="running")
        for bats in bouts.bats[:, world]:
            self.bring(bats)
        state = self.referee.state()
        assert state.phase == "finished"
        return state


def test_the_whole_service_gives_the_same_verdict_bout_after_bout(recorded: list[RecordedBouts]):
    table = Table()
    for number, bouts in enumerate(recorded):
        for world in (0, 57, 119):
            state = table.verdict(bouts, world, f"bout-{number}-{world}")
            said = [getattr(state, name) for name in COUNTERS]
            assert said == [getattr(bouts.results, name)[world] for name in COUNTERS]
            assert (state.step, state.missed_ticks) == (RULES.bout_steps, 0)
            assert state.seconds == pytest.approx(0.01 * RULES.bout_steps)
