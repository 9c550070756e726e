"""A learner and a league on one memory bus: what one forgets, the other knows."""

from pathlib import Path
from typing import Any

import msgspec
import pytest

from services.league.config import LeagueConfig
from services.league.events import VersionEntered
from services.league.ledger import open_read_only
from services.league.service import League
from services.learner.checkpoint import CheckpointStore
from services.learner.service import Learner, RunFacts
from shared.bus.memory import MemoryHub
from shared.clock import ManualClock
from shared.game.rules import RuleBook
from shared.messages.league import Lease, LeaseRequest
from shared.messages.topics import LEASE, POLICY, ROLLOUT, VERSION
from shared.messages.training import Receipt, Rollout
from tests.unit.league.driving import version_report
from tests.unit.learner.making import BOUT_STEPS, SMALL, rollout
from tests.unit.policy.making import FIT

FACTS = RunFacts(run="test", seed=3, fit=FIT, rules=RuleBook(bout_steps=BOUT_STEPS))
BATCHES = msgspec.structs.replace(SMALL, batch_samples=128)
"""Of two rollouts."""
CFG = LeagueConfig(
    seed=3,
    iterations=1,
    antagonist_updates=100,
    convergence_min_updates=0,
    evaluation_bouts=0,
    lease_seconds=600.0,
)


class Both:
    """League and antagonist's learner; the protagonist's learner and the actor by hand."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.clock = ManualClock(100.0)
        self.hub = MemoryHub(self.clock)
        self.actor = self.hub.join("actor-0")
        self.policies = self.actor.subscribe(POLICY)
        self.league = League(
            CFG, self.hub.join("league-0"), self.clock, folder / "run", "test", 3, False
        )
        self.sequence = 0
        self.start_learner()
        self.actor.ask(VERSION, version_report("protagonist", 0, -1), 1.0)
        self.settle()
        self.lease = self._lease()

    def start_learner(self) -> None:
        self.bus = self.hub.join("learner-antagonist")
        self.learner = Learner(
            BATCHES, "antagonist", FACTS, self.folder / "learner", self.bus, self.clock
        )

    def kill_learner(self) -> None:
        self.bus.close()

    def settle(self, *, learner: bool = True) -> None:
        """Let everybody take what has arrived."""
        for _ in range(4):
            self.clock.advance(1.0)
            self.league.tick()
            if learner:
                self.learner.tick()

    def _lease(self) -> Lease:
        pending = self.actor.ask(LEASE, LeaseRequest(actor="actor-0", boot="b0", num_envs=8), 1.0)
        self.settle()
        lease = pending.take()
        assert isinstance(lease, Lease)
        assert lease.stage is not None
        return lease

    def a_rollout(self) -> Rollout:
        self.sequence += 1
        assert self.lease.stage is not None
        return rollout(
            self.sequence, lease=self.lease.lease, seed=self.lease.seed,
            opponent=self.lease.stage.opponent, policy_version=self.learner.version,
        )  # fmt: skip

    def rollouts_behind(self, version: int) -> tuple[str, ...]:
        """Return the names that the ledger has for a version of the antagonist."""
        with open_read_only(self.folder / "run" / "league.sqlite") as ledger:
            (found,) = (
                entry.event
                for entry in ledger.replay()
                if isinstance(entry.event, VersionEntered)
                and entry.event.key == f"antagonist:{version}"
            )
        return found.rollouts

    def send(self, message: Rollout) -> Any:
        """Hand a rollout to the learner, which takes it at once."""
        pending = self.actor.ask(ROLLOUT, message, 1000.0, agent="antagonist")
        self.learner.tick()
        return pending

    def damage_newest_checkpoint(self) -> None:
        store = CheckpointStore(self.folder / "learner", "test", "antagonist", 3)
        path = store.path(store.versions()[0])
        path.write_bytes(path.read_bytes()[:-10])


@pytest.fixture
def both(tmp_path: Path) -> Both:
    """Version 1 is out, the next is made from two rollouts."""
    both = Both(tmp_path)
    both.send(both.a_rollout())  # warms the normaliser up
    both.settle()
    assert both.learner.version == 1
    return both


def entered_but_not_acknowledged(both: Both) -> list[Rollout]:
    """Have version 2 entered, and the learner die before it tells; its checkpoint is damaged."""
    messages = [both.a_rollout(), both.a_rollout()]
    for message in messages:
        both.send(message)
    both.settle(learner=False)
    names = tuple(message.name for message in messages)
    assert both.rollouts_behind(2) == names
    both.kill_learner()
    both.damage_newest_checkpoint()
    both.start_learner()
    assert both.learner.version == 1
    return messages


@pytest.mark.parametrize("is_early", [False, True], ids=["afterwards", "before-the-receipt"])
def test_what_the_ledger_has_learned_from_counts_once_though_its_checkpoint_is_lost(
    both: Both, is_early: bool
):
    one, two = entered_but_not_acknowledged(both)
    state = both.league.state
    if is_early:  # the actor tries again before the league has answered
        again = both.send(one)
        both.settle()
    else:
        both.settle()
        again = both.send(one)
    assert again.take() == Receipt(accepted=True)
    fresh = [both.a_rollout(), both.a_rollout()]
    pending = [both.send(message) for message in fresh]
    both.settle()
    assert [answer.take() for answer in pending] == [Receipt(accepted=True)] * 2
    names = tuple(message.name for message in fresh)
    assert both.rollouts_behind(3) == names
    assert both.send(two).take() == Receipt(accepted=True)
    assert state.repeated_rollouts == 0
    both.league.close()


def test_what_the_ledger_told_is_known_after_another_death(both: Both):
    one, _ = entered_but_not_acknowledged(both)
    both.settle()
    for _ in range(2):
        both.send(both.a_rollout())
    both.settle()
    assert both.learner.version == 3
    both.kill_learner()
    both.start_learner()
    assert both.send(one).take() == Receipt(accepted=True)
    both.league.close()
