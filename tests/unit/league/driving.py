"""Plays the actors and learners of a league in tests: real messages over a real in-memory bus."""

import functools
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from services.league.config import LeagueConfig
from services.league.leases import awaits_restart
from services.league.service import League
from shared.bus.base import NoAnswer, Refused
from shared.bus.memory import MemoryBus, MemoryHub
from shared.clock import ManualClock
from shared.messages.league import BoutResults, Incident, Lease, LeaseRenewal, LeaseRequest
from shared.messages.message import Message
from shared.messages.topics import INCIDENT, LEASE, RENEWAL, RESULTS, VERSION, Service
from shared.messages.training import ACTION_DIM, OBS_DIM, Agent, UpdateMetrics, VersionReport
from shared.policy.action import ACTION_SCHEMA
from shared.policy.mlp import PolicyWeights
from shared.policy.observation import OBSERVATION_SCHEMA
from shared.policy.snapshot import Card, Snapshot, normaliser_hash, pack

SMALL = LeagueConfig(
    iterations=2,
    antagonist_updates=3,
    protagonist_updates=2,
    convergence_min_updates=0,
    evaluation_bouts=5,
    batch_rollouts=4,
)
MODEL = "m" * 64
SAMPLES = 1000


@functools.cache
def snapshot(agent: Agent, version: int, stage: int = 0, salt: float = 0.0) -> Snapshot:
    """Return a real, tiny policy artifact; another ``salt`` makes another hash."""
    mean, std = np.full(OBS_DIM, salt, np.float32), np.ones(OBS_DIM, np.float32)
    weights = PolicyWeights(
        obs_mean=mean,
        obs_std=std,
        layers=((np.zeros((ACTION_DIM, OBS_DIM), np.float32), np.zeros(ACTION_DIM, np.float32)),),
        log_std=np.zeros(ACTION_DIM, np.float32),
        activation="elu",
    )
    card = Card(
        agent=agent,
        policy_version=version,
        stage=stage,
        run="test",
        seed=0,
        total_samples=version * SAMPLES,
        observation_schema=OBSERVATION_SCHEMA,
        action_schema=ACTION_SCHEMA,
        normaliser=normaliser_hash(mean, std),
        control_timestep=0.01,
        offset_bound_m=0.0375,
        offset_bound_rad=0.06,
        model=MODEL,
        activation="elu",
        hidden_dims=(),
    )
    return pack(card, weights)


def metrics(version: int, **changes: Any) -> UpdateMetrics:
    """Return plausible numbers of an update."""
    plain = UpdateMetrics(
        samples=SAMPLES, total_samples=version * SAMPLES, reward_mean=0.1, value_loss=1.0,
        surrogate_loss=0.0, entropy=2.0, approx_kl=0.01, clip_fraction=0.1,
        explained_variance=0.5, policy_lag_mean=1.0, learning_rate=3e-4, action_std=1.0,
        wait_seconds=0.1, update_seconds=0.2,
    )  # fmt: skip
    return msgspec.structs.replace(plain, **changes)


def version_report(
    agent: Agent, version: int, stage: int, salt: float = 0.0, *, restart: bool = False
) -> VersionReport:
    """Return a learner's report of a new version; of a policy it went back to for a round."""
    policy = snapshot(agent, version, stage, salt)
    is_made_of_none = restart or version == 0
    return VersionReport(
        agent=agent,
        policy_version=version,
        stage=stage,
        snapshot=policy.digest,
        payload=np.frombuffer(policy.payload, np.uint8),
        rollouts=() if is_made_of_none else (f"{agent}boot:{version}",),
        metrics=None if is_made_of_none else metrics(version, reward_mean=version * 37 % 11 / 10),
    )


def bout_results(
    lease: Lease, actor: str, boot: str, sequence: int, *, bouts: int | None = None,
    attack: int = 100, complete: bool = True, learner: str = "sha256:" + "a" * 64, **changes: Any,
) -> BoutResults:  # fmt: skip
    """Return results that fit a lease: each bout scores ``attack`` less one penalty step."""
    count = bouts if bouts is not None else (lease.bouts or 3)
    if lease.stage is not None:
        learns = lease.stage.agent == "antagonist"
        antagonist = learner if learns else lease.stage.opponent
        protagonist = lease.stage.opponent if learns else learner
    else:
        antagonist, protagonist = lease.antagonist, lease.protagonist
    fields: dict[str, Any] = {
        "actor": actor,
        "boot": boot,
        "sequence": sequence,
        "lease": lease.lease,
        "kind": lease.kind,
        "stage": lease.stage.index if lease.stage is not None else -1,
        "antagonist": antagonist,
        "protagonist": protagonist,
        "model": MODEL,
        "seed": lease.seed,
        "bouts": np.arange(count, dtype=np.int64),
        "score": np.full(count, attack - 10, np.float32),
        "attack_steps": np.full(count, attack, np.int32),
        "penalty_steps": np.ones(count, np.int32),
        "camping_steps": np.zeros(count, np.int32),
        "complete": np.full(count, complete),
        "features": np.full((0 if lease.stage is not None else count, 2, 8), 0.1, np.float32),
    }
    return BoutResults(**(fields | changes))


class Match:
    """A league with everybody it talks to, in one thread."""

    def __init__(
        self, folder: Path, cfg: LeagueConfig = SMALL, *, seed: int = 7, serial: bool = False
    ) -> None:
        self.folder, self.cfg, self.seed, self.serial = folder, cfg, seed, serial
        self.clock = ManualClock(100.0)
        self.hub = MemoryHub(self.clock)
        self.peer: MemoryBus = self.hub.join("peer")
        self._sequence = 0
        self.start()

    def start(self) -> None:
        """Start the league process."""
        self.bus = self.hub.join("league")
        self.league = League(
            self.cfg, self.bus, self.clock, self.folder, "test", self.seed, self.serial
        )

    def restart(self) -> None:
        """Stop the league and start another on the same folder."""
        self.stop()
        self.start()

    def stop(self) -> None:
        """End the league process."""
        self.league.close()
        self.bus.close()

    def ask(self, service: Service[Any, Any], message: Message) -> Any:
        """Return the league's answer, None when it gave none."""
        pending = self.peer.ask(service, message, timeout=1.0)
        self.league.tick()
        answer = pending.take()
        return None if isinstance(answer, NoAnswer) else answer

    def sequence(self) -> int:
        """Return a number that no results message had."""
        self._sequence += 1
        return self._sequence

    def lease(self, actor: str = "actor-0", boot: str = "b0", num_envs: int = 128) -> Lease:
        """Ask for work."""
        answer = self.ask(LEASE, LeaseRequest(actor=actor, boot=boot, num_envs=num_envs))
        assert isinstance(answer, Lease), answer
        return answer

    def renew(self, lease: Lease, actor: str = "actor-0", boot: str = "b0") -> Any:
        """Renew a lease."""
        return self.ask(RENEWAL, LeaseRenewal(actor=actor, boot=boot, lease=lease.lease))

    def report(
        self, agent: Agent, version: int, stage: int, salt: float = 0.0, *, restart: bool = False
    ) -> Any:
        """Report a version."""
        return self.ask(VERSION, version_report(agent, version, stage, salt, restart=restart))

    def report_next(self) -> Any:
        """Report what the learner in turn makes next; at the start of a round, what it goes
        back to."""
        record = self.league.state.stage
        assert record is not None
        stage = record.stage
        version = self.league.state.latest_version(stage.agent) + 1
        return self.report(stage.agent, version, stage.index, restart=awaits_restart(record))

    def both_start(self) -> None:
        """Report version 0 of both agents: the first stage begins."""
        self.report("antagonist", 0, -1)
        self.report("protagonist", 0, -1)

    def play(self, lease: Lease, actor: str = "actor-0", boot: str = "b0", **changes: Any) -> Any:
        """Report results under a lease."""
        sequence = changes.pop("sequence", None) or self.sequence()
        return self.ask(RESULTS, bout_results(lease, actor, boot, sequence, **changes))

    def note(self, sequence: int, kind: str = "process_restarted") -> Any:
        """Report an incident."""
        incident = Incident(
            source="supervisor", boot="s0", sequence=sequence, kind=kind, detail="actor-0", at_ns=5
        )
        return self.ask(INCIDENT, incident)

    def learn_stage(self) -> None:
        """Make updates, with bouts between them, until the stage that runs is over."""
        stage = self.league.state.stage
        assert stage is not None
        index = stage.stage.index
        if awaits_restart(stage):
            assert self.report_next().accepted
        lease = self.lease()
        while (running := self.league.state.stage) is not None and running.stage.index == index:
            self.play(lease)
            answer = self.report_next()
            assert not isinstance(answer, Refused), answer
            self.clock.advance(1.0)

    def evaluate(self, num_envs: int = 128) -> None:
        """Play evaluation bouts until there are none left."""
        while (lease := self.lease(num_envs=num_envs)).kind == "evaluate":
            self.play(lease)

    def finish(self) -> None:
        """Take the run from its start to its end."""
        self.both_start()
        for _ in range(2 * self.cfg.iterations):
            self.learn_stage()
        self.evaluate()
        while self.league.state.stage is not None:
            self.learn_stage()
