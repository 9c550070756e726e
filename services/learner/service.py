"""The learner: gathers rollouts, updates, writes a checkpoint, has the version entered, answers.

A rollout is answered only when a checkpoint holds the update made from it and the league has the
version in its ledger. Whatever happens before, the actor still has the rollout and sends it again.

A round of phase two begins with a version made from no rollout: policy, critic, normalisers and
optimiser as phase one left them, the minibatches drawn from a seed of the round's own.
"""

from pathlib import Path

import msgspec
import numpy as np
import structlog

from services.learner.checkpoint import CheckpointStore, Meta
from services.learner.config import LearnerConfig
from services.learner.intake import Intake
from services.learner.ppo import PolicyOptimiser, UpdateStats
from services.learner.signing import RunFacts, seed_of, sign
from services.learner.starvation import Starvation
from shared.bus.base import Bus
from shared.bus.delivery import Applied, Outbox
from shared.clock import Clock
from shared.errors import RiposteError
from shared.messages.message import Bytes
from shared.messages.topics import LEASES, POLICY, ROLLOUT, SCHEDULE, VERSION
from shared.messages.training import (
    Agent,
    PolicyAnnouncement,
    UpdateMetrics,
    VersionReceipt,
    VersionReport,
)
from shared.policy.snapshot import Snapshot
from shared.runtime.incidents import Incidents
from shared.runtime.rate import Rate
from shared.runtime.service import Health

__all__ = ["Learner", "RunFacts"]

log = structlog.get_logger()

MAX_INCIDENTS = 256
"""What one learner process tells the report of; a flood would say nothing more."""
REPORT_TIMEOUT = 5.0
"""Seconds to wait for the league before a version is reported again."""


class Learner:
    """One agent's PPO."""

    def __init__(
        self,
        cfg: LearnerConfig,
        agent: Agent,
        facts: RunFacts,
        folder: Path,
        bus: Bus,
        clock: Clock,
        *,
        version: int | None = None,
    ) -> None:
        """Continue from the newest usable checkpoint, or begin.

        Args:
            cfg: PPO's numbers.
            agent: who learns here.
            facts: of the run.
            folder: of this agent's checkpoints.
            bus: this process's end of the bus.
            clock: spaces the reports.
            version: continue from exactly this checkpoint and forget newer ones (serial resume).

        Raises:
            CheckpointError: there are checkpoints, and none is usable.
        """
        self._cfg = cfg
        self._agent: Agent = agent
        self._facts = facts
        self._bus = bus
        self._clock = clock
        self._optimiser = PolicyOptimiser(cfg, seed_of(facts.seed, agent))
        self._store = CheckpointStore(folder, facts.run, agent, cfg.keep_checkpoints)
        self._intake = Intake(
            bus.answer(ROLLOUT, agent=agent), clock, cfg, agent, facts.fit.model or "", facts.rules
        )
        self._schedule = bus.subscribe(SCHEDULE)
        self._leases = bus.subscribe(LEASES)
        self._reports: Outbox[VersionReport, VersionReceipt] = Outbox(
            bus, VERSION, clock, window=1, timeout=REPORT_TIMEOUT
        )
        self._incidents = Incidents(bus, clock, window=64, most=MAX_INCIDENTS)
        self._total_samples = 0
        self._announced = False
        self._waiting_since = clock.now()
        self._samples = Rate(clock, 20.0)
        self._starvation = Starvation(clock)
        self._last_metrics: UpdateMetrics | None = None
        self._last_error = ""
        self._updates = 0
        self._meta = self._begin(version)
        self._snapshot = self._make_snapshot()
        self._report()

    @property
    def version(self) -> int:
        """Return the newest policy version."""
        return self._meta.policy_version

    @property
    def quiet(self) -> bool:
        """Return whether nothing is under way between this learner and anybody."""
        return self._announced and self._intake.is_empty and not self._reports.unacknowledged

    def _begin(self, version: int | None) -> Meta:
        """Return the checkpoint to continue from, made now when there is none."""
        if version is not None:
            self._store.discard_after(version)
            meta, tensors = self._store.load(version)
            faults: list[str] = []
        elif (found := self._store.load_newest()) is not None:
            meta, tensors, faults = found
        else:
            meta = self._meta_of(0, -1, 0, (), None)
            self._store.save(meta, self._optimiser.state())
            return meta
        for fault in faults:
            self._last_error = fault
            self._incidents.note(
                "checkpoint_corrupt", f"{fault}; continued from version {meta.policy_version}"
            )
        self._optimiser.restore(tensors)
        self._intake.applied = Applied.from_json(meta.applied)
        self._intake.floor = meta.floor
        self._total_samples = meta.total_samples
        self._last_metrics = meta.metrics
        log.info("checkpoint_restored", version=meta.policy_version)
        return meta

    # -- the loop ---------------------------------------------------------------------------

    def tick(self) -> bool:
        """Take what arrived, and update when there is enough of it."""
        self._starvation.end()
        did = self._take_schedule()
        did |= self._take_receipt()
        self._incidents.pump()
        entering = self._meta.rollouts if self._reports.unacknowledged else ()
        did |= self._go_to_round()
        did |= self._intake.take(self.version, entering)
        while self._intake.faults:
            self._last_error = self._intake.faults.popleft()
            self._incidents.note("rollout_refused", self._last_error)
        if self._announced and self._intake.samples >= self._intake.needed(self.version):
            self._update()
            did = True
        self._starvation.begin(is_starved=self._announced and self._intake.in_turn)
        return did

    def _take_schedule(self) -> bool:
        did = False
        while (leases := self._leases.take()) is not None:
            did = True
            self._intake.know(leases)
        while (schedule := self._schedule.take()) is not None:
            did = True
            was_in_turn = self._intake.in_turn
            self._intake.follow(schedule)
            if self._intake.in_turn and not was_in_turn:
                self._waiting_since = self._clock.now()
        return did

    def _take_receipt(self) -> bool:
        """Take the league's answer to the version report: then, and only then, answer rollouts."""
        did = False
        for report, receipt in self._reports.pump():
            did = True
            elsewhere = self._intake.learned_elsewhere(receipt.learned_elsewhere)
            if not receipt.accepted:
                self._renumber(report, receipt, elsewhere)
                continue
            # First the policy, then the room to play on: or the next rollout is a version behind.
            self._announce()
            self._intake.commit()
            stage = self._intake.stage
            if stage is not None and receipt.stage != stage.index:
                self._intake.end_stage()
        for _, reason in self._reports.take_refused():
            raise RiposteError(f"the league refused version {self.version}: {reason}")
        return did

    def _renumber(self, report: VersionReport, receipt: VersionReceipt, elsewhere: Applied) -> None:
        """The ledger holds another policy under this version: go on above it.

        Rollouts that it has behind others of this learner's versions it does not get once more: a
        checkpoint that was restored, and is signed anew, was made from them.
        """
        version = receipt.latest_version + 1
        log.warning("version_renumbered", version=report.policy_version, now=version)
        self._incidents.note(
            "version_renumbered",
            f"{self._agent} version {report.policy_version} is taken by another policy "
            f"({receipt.reason}); continued as version {version}",
        )
        rollouts = tuple(name for name in self._meta.rollouts if not elsewhere.contains_name(name))
        self._meta = msgspec.structs.replace(
            self._meta,
            policy_version=version,
            applied=self._intake.applied.to_json(),  # with what was learned elsewhere
            rollouts=rollouts,
            metrics=self._meta.metrics if rollouts else None,
        )
        self._store.save(self._meta, self._optimiser.state())
        self._snapshot = self._make_snapshot()
        self._report()

    def _go_to_round(self) -> bool:
        """Go back to the end of phase one when a round of phase two has begun."""
        stage = self._intake.stage
        if stage is None or not (self._intake.in_turn and self._announced):
            return False
        if stage.phase != "two" or stage.round == self._meta.round:
            return False
        self._intake.release(f"round {stage.round} begins at the warm start")
        if self._meta.round == 0 and not self._store.warm_path.exists():
            self._store.save_warm(self._meta, self._optimiser.state())
        warm, tensors = self._store.load_warm()
        self._optimiser.restore(tensors)
        self._optimiser.reseed(seed_of(self._facts.seed, self._agent, stage.round))
        log.info("round_begun", round=stage.round, warm_start=warm.policy_version)
        version = self.version + 1
        self._intake.floor = version
        self._meta = msgspec.structs.replace(
            self._meta_of(version, stage.index, 0, (), None), round=stage.round
        )
        self._store.save(self._meta, self._optimiser.state())
        self._snapshot = self._make_snapshot()
        self._report()
        return True

    # -- updating ---------------------------------------------------------------------------

    def _update(self) -> None:
        """Learn from what was gathered, write the checkpoint, report the version."""
        rollouts = self._intake.begin(self.version)
        if not rollouts:
            return
        began_at = self._clock.now()
        waited = began_at - self._waiting_since
        stage = rollouts[0].stage
        done = self._meta.stage_updates if self._meta.stage == stage else 0
        metrics = None
        if self.version == 0 and self._cfg.warm_up_samples:
            self._optimiser.warm_up(rollouts)
        else:
            learning_rate = self._cfg.learning_rate_in(self._intake.stage, done)
            stats = self._optimiser.update(rollouts, learning_rate)
            lag = float(np.mean([self.version - r.policy_version for r in rollouts]))
            self._total_samples += stats.samples
            seconds = self._clock.now() - began_at
            metrics = self._metrics(stats, learning_rate, lag, waited, seconds)
        self._updates += 1
        self._samples.add(sum(r.rewards.size for r in rollouts))
        names = tuple(rollout.name for rollout in rollouts)
        self._meta = self._meta_of(self.version + 1, stage, done + 1, names, metrics)
        self._last_metrics = metrics
        self._store.save(self._meta, self._optimiser.state())
        self._snapshot = self._make_snapshot()
        self._report()

    def _metrics(
        self, stats: UpdateStats, learning_rate: float, lag: float, waited: float, seconds: float
    ) -> UpdateMetrics:
        return UpdateMetrics(
            samples=stats.samples,
            total_samples=self._total_samples,
            reward_mean=stats.reward_mean,
            value_loss=stats.value_loss,
            surrogate_loss=stats.surrogate_loss,
            entropy=stats.entropy,
            approx_kl=stats.approx_kl,
            clip_fraction=stats.clip_fraction,
            explained_variance=stats.explained_variance,
            policy_lag_mean=lag,
            learning_rate=learning_rate,
            action_std=stats.action_std,
            wait_seconds=waited,
            update_seconds=seconds,
        )

    def _meta_of(
        self,
        version: int,
        stage: int,
        stage_updates: int,
        rollouts: tuple[str, ...],
        metrics: UpdateMetrics | None,
    ) -> Meta:
        return Meta(
            run=self._facts.run,
            agent=self._agent,
            seed=self._facts.seed,
            policy_version=version,
            stage=stage,
            stage_updates=stage_updates,
            total_samples=self._total_samples,
            applied=self._intake.applied.to_json(),
            rollouts=rollouts,
            metrics=metrics,
            round=self._meta.round if version else 0,
            floor=self._intake.floor,
        )

    def _make_snapshot(self) -> Snapshot:
        return sign(self._cfg, self._facts, self._meta, self._optimiser.weights())

    def _report(self) -> None:
        """Ask the league to enter the newest version; actors get it when that is done."""
        self._announced = False
        self._reports.put(
            VersionReport(
                agent=self._agent,
                policy_version=self.version,
                stage=self._meta.stage,
                snapshot=self._snapshot.digest,
                payload=_bytes(self._snapshot),
                rollouts=self._meta.rollouts,
                metrics=self._meta.metrics,
            )
        )

    def _announce(self) -> None:
        self._announced = True
        self._waiting_since = self._clock.now()
        self._bus.publish(
            POLICY,
            PolicyAnnouncement(
                agent=self._agent,
                policy_version=self.version,
                stage=self._meta.stage,
                snapshot=self._snapshot.digest,
                payload=_bytes(self._snapshot),
            ),
            agent=self._agent,
        )

    # -- how it is --------------------------------------------------------------------------

    def health(self) -> Health:
        """Return how this learner is."""
        waiting = ""
        if not self._announced:
            reason = self._reports.last_failure or "to enter the version"
            waiting, state = f"league: {reason}", f"version {self.version} made"
        elif self._intake.in_turn:
            gathered = f"{self._intake.samples} of {self._cfg.batch_samples} samples"
            state = f"version {self.version}: {gathered}"
            waiting = "actors: rollouts"
        else:
            state = f"version {self.version}, not in turn"
        rates = {"samples_per_s": self._samples.per_second()}
        if self._last_metrics is not None:
            rates["policy_lag"] = self._last_metrics.policy_lag_mean
            rates["update_seconds"] = self._last_metrics.update_seconds
        counts = {"updates": self._updates, "starved_ms": self._starvation.milliseconds}
        return Health(
            state=state,
            waiting_for=waiting,
            waiting_seconds=self._clock.now() - self._waiting_since if waiting else 0.0,
            rates=rates,
            counters=self._intake.counters | counts,
            last_error=self._last_error,
            policies={self._agent: self.version},
        )

    def close(self) -> None:
        """Nothing to finish: the checkpoint is written, and unanswered rollouts are sent again."""


def _bytes(snapshot: Snapshot) -> Bytes:
    return np.frombuffer(snapshot.payload, np.uint8)
