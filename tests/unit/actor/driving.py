"""Plays the league and the learners of an actor in tests: real physics, a real in-memory bus."""

import functools
from typing import Any

import msgspec
import numpy as np

from services.actor.config import ActorConfig
from services.actor.reports import GATHER_SECONDS
from services.actor.service import Actor
from shared.bus.memory import MemoryHub
from shared.clock import ManualClock
from shared.game.reward import RewardConfig
from shared.game.rules import RuleBook
from shared.messages.league import (
    BoutResults,
    Lease,
    LeaseStatus,
    Schedule,
    SnapshotReply,
    Stage,
)
from shared.messages.topics import (
    FRAMES,
    LEASE,
    POLICY,
    RENEWAL,
    RESULTS,
    ROLLOUT,
    SCHEDULE,
    SNAPSHOT,
)
from shared.messages.training import AGENTS, Agent, PolicyAnnouncement, Receipt, Rollout
from shared.policy.action import ActionConfig
from shared.policy.snapshot import Fit, Snapshot
from shared.sim.config import SimConfig
from shared.sim.env import FencingEnv
from shared.sim.model import FencingModel
from tests.unit.policy.making import snapshot

WORLDS, STEPS, BOUT_STEPS = 8, 20, 80
RULES = RuleBook(bout_steps=BOUT_STEPS, camping_steps=7)
CONFIG = ActorConfig(
    num_envs=WORLDS, rollout_steps=STEPS, opponent_cache=2, frame_period=0.0,
    ask_timeout=5.0, acknowledge_timeout=60.0,
)  # fmt: skip
STAGE = Stage(
    index=0,
    phase="one",
    iteration=1,
    agent="antagonist",
    opponent="scripted:static",
    max_updates=3,
    score_weight=1.0,
    shaping_weight=0.0,
)
TRAIN = Lease(
    lease="L000001", kind="train", stage=STAGE, stochastic=True, seed=5, expires_in=9.0, window=4
)


@functools.cache
def model() -> FencingModel:
    """The arena with so large a target that something happens in it at once."""
    return FencingModel.build(SimConfig(target_radius=0.45))


def fit() -> Fit:
    return Fit.of(ActionConfig(), 0.01, model().hash)


def worlds(num_envs: int = WORLDS) -> FencingEnv:
    return FencingEnv(model(), RULES, ActionConfig(), num_envs)


def policy(seed: int = 0, version: int = 0, **changes: Any) -> Snapshot:
    """A snapshot that fits here."""
    return snapshot(seed, policy_version=version, **({"model": model().hash} | changes))


class Hall:
    """An actor with everybody it talks to, in one thread."""

    def __init__(self, cfg: ActorConfig = CONFIG) -> None:
        self.cfg = cfg
        self.clock = ManualClock(30.0)
        self.hub = MemoryHub(self.clock, max_messages=1024)
        self.league, self.learner = self.hub.join("league-0"), self.hub.join("learner-0")
        self.leases = self.league.answer(LEASE)
        self.renewals = self.league.answer(RENEWAL)
        self.snapshots = self.league.answer(SNAPSHOT)
        self.reports = self.league.answer(RESULTS)
        self.inboxes = {agent: self.learner.answer(ROLLOUT, agent=agent) for agent in AGENTS}
        self.frames = self.league.subscribe(FRAMES)
        self.offer: Lease = Lease(lease="", kind="none", reason="nothing to do")
        """What the next request for work is answered with."""
        self.renewal: LeaseStatus | None = LeaseStatus(alive=True, expires_in=9.0, window=4)
        """What renewals are answered with; None for silence."""
        self.stored: dict[str, bytes] = {}
        """Snapshots that the league has, by reference."""
        self.fetched: list[str] = []
        self.requests: list[float] = []
        """When work was asked for."""
        self.renewed: list[float] = []
        self.results: list[BoutResults] = []
        self.arrived: list[tuple[Rollout, Any]] = []
        """Rollouts not answered yet, with the request to answer."""
        self.start()

    def start(self) -> None:
        """Start the actor process."""
        self.bus = self.hub.join("actor-0")
        self.env = worlds(self.cfg.num_envs)
        self.actor = Actor(self.cfg, RewardConfig(), self.env, fit(), self.bus, self.clock)

    def tick(self, count: int = 1) -> None:
        """Let the actor work, and answer what it asks, except rollouts."""
        for _ in range(count):
            self.actor.tick()
            self._answer()

    def _answer(self) -> None:
        now = self.clock.now()
        while (lease := self.leases.take()) is not None:
            assert lease.message.num_envs == self.cfg.num_envs
            self.requests.append(now)
            lease.reply(self.offer)
        while (renewal := self.renewals.take()) is not None:
            self.renewed.append(now)
            if self.renewal is not None:
                renewal.reply(self.renewal)
        while (wanted := self.snapshots.take()) is not None:
            reference = wanted.message.snapshot
            self.fetched.append(reference)
            payload = self.stored.get(reference)
            wanted.reply(
                SnapshotReply(
                    found=payload is not None,
                    payload=np.frombuffer(payload or b"", np.uint8),
                    reason="" if payload is not None else "it was never reported here",
                )
            )
        while (report := self.reports.take()) is not None:
            self.results.append(report.message)
            report.reply(Receipt(accepted=True))
        for inbox in self.inboxes.values():
            while (request := inbox.take()) is not None:
                self.arrived.append((request.message, request))

    def hear_results(self) -> None:
        """Let pass what finished bouts may wait for others, and hear them."""
        self.clock.advance(GATHER_SECONDS)
        self.tick(2)

    def acknowledge(self, accepted: bool = True, reason: str = "") -> list[Rollout]:
        """Answer every rollout that has arrived, and return them."""
        rollouts: list[Rollout] = []
        for rollout, request in self.arrived:
            request.reply(Receipt(accepted=accepted, reason=reason))
            rollouts.append(rollout)
        self.arrived = []
        return rollouts

    def announce(self, made: Snapshot, agent: Agent = "antagonist") -> None:
        """Be the learner that has a new version."""
        self.learner.publish(
            POLICY,
            PolicyAnnouncement(
                agent=agent,
                policy_version=made.card.policy_version,
                stage=0,
                snapshot=made.digest,
                payload=np.frombuffer(made.payload, np.uint8),
            ),
            agent=agent,
        )

    def schedule(self, stage: Stage | None) -> None:
        self.league.publish(SCHEDULE, Schedule(stage=stage, versions={}))

    def store(self, made: Snapshot) -> str:
        """Put a snapshot into the league's store and return its reference."""
        self.stored[made.reference] = made.payload
        return made.reference

    def train(self, **changes: Any) -> None:
        """Grant a training lease, with a policy to play it."""
        self.offer = msgspec.structs.replace(TRAIN, **changes)
        self.announce(policy())
        self.play()

    def play(self, ticks: int = 12) -> None:
        """Tick until the actor has nothing more to do, at most so often."""
        self.tick(ticks)

    def rollouts(self, count: int) -> list[Rollout]:
        """Acknowledge rollouts until there were so many, and return exactly those."""
        found: list[Rollout] = []
        while len(found) < count:
            self.tick()
            found += self.acknowledge()
        return found[:count]
