"""The state of a run, folded from the ledger's events.

``RunState.apply`` is the only way in: the running league, a restarted league and a report all
hold the same state because they applied the same events. Nothing here reads a clock or a file.
"""

import dataclasses
from collections.abc import Iterable

from services.league import events
from services.league.config import LeagueConfig
from services.league.events import Entry, LeaseEnd
from shared.messages.league import Stage
from shared.messages.training import AGENTS, Agent, UpdateMetrics

SCRIPTED_STATIC = "scripted:static"


@dataclasses.dataclass(frozen=True)
class VersionRecord:
    """One policy version in the ledger."""

    agent: Agent
    version: int
    stage: int
    """-1 for version 0."""
    snapshot: str
    """Content hash (64 hex digits)."""
    rollouts: tuple[str, ...]
    metrics: UpdateMetrics | None
    at_ns: int

    @property
    def ref(self) -> str:
        """Return the player reference of this version."""
        return f"sha256:{self.snapshot}"


@dataclasses.dataclass
class CurvePoint:
    """The complete training bouts that ended while a stage had made ``update`` updates."""

    update: int
    """Updates of the stage so far, from 0."""
    total_samples: int
    """Samples both agents together had learned from, over the whole run."""
    at_ns: int
    """When the first of these bouts entered the ledger."""
    score: list[float] = dataclasses.field(default_factory=list[float])
    """The antagonist's total of each bout."""
    attack_steps: list[int] = dataclasses.field(default_factory=list[int])
    penalty_steps: list[int] = dataclasses.field(default_factory=list[int])
    camping_steps: list[int] = dataclasses.field(default_factory=list[int])

    @property
    def mean(self) -> float:
        """Return the mean score; there is at least one bout in every point."""
        return sum(self.score) / len(self.score)


@dataclasses.dataclass
class StageRecord:
    """One stage: its order, the versions made in it, the bouts played in it."""

    stage: Stage
    started_at_ns: int
    ended_at_ns: int | None = None
    end_reason: str = ""
    """``converged`` or ``budget``; empty while it runs."""
    end_version: int = -1
    end_snapshot: str = ""
    """Content hash of what the agent had learned when the stage ended."""
    versions: list[VersionRecord] = dataclasses.field(default_factory=list[VersionRecord])
    points: list[CurvePoint] = dataclasses.field(default_factory=list[CurvePoint])
    """Learning curve, oldest first; updates in which no complete bout ended have no point."""
    complete_bouts: int = 0
    incomplete_bouts: int = 0

    @property
    def updates(self) -> int:
        """Return how many updates were made in this stage."""
        return len(self.versions)

    @property
    def samples(self) -> int:
        """Return the samples learned from in this stage."""
        return sum(version.metrics.samples for version in self.versions if version.metrics)


@dataclasses.dataclass
class EvaluationRecord:
    """All bouts of one pairing of the evaluation; the lists grow as bouts are played."""

    antagonist: str
    protagonist: str
    """Player references."""
    planned: int
    score: list[float] = dataclasses.field(default_factory=list[float])
    attack_steps: list[int] = dataclasses.field(default_factory=list[int])
    penalty_steps: list[int] = dataclasses.field(default_factory=list[int])
    camping_steps: list[int] = dataclasses.field(default_factory=list[int])
    played: list[bool] = dataclasses.field(default_factory=list[bool])
    """By bout number of the plan; bouts may finish in any order."""

    @property
    def done(self) -> int:
        """Return how many bouts have been played."""
        return len(self.score)


@dataclasses.dataclass(frozen=True)
class IncidentRecord:
    """Something a report should mention."""

    source: str
    what: str
    """``process_restarted``, ``rollout_refused``, ..."""
    detail: str
    at_ns: int
    """By the reporter's wall clock."""


@dataclasses.dataclass(frozen=True)
class LeaseRecord:
    """One lease, alive as long as ``end_reason`` is empty."""

    grant: events.LeaseGranted
    granted_at_ns: int
    end_reason: LeaseEnd | None = None
    ended_at_ns: int = 0


@dataclasses.dataclass
class RunState:
    """Everything the ledger says about a run."""

    position: int = 0
    """Sequence number of the last event applied."""
    last_at_ns: int = 0
    run: str = ""
    seed: int = 0
    serial: bool = False
    config: LeagueConfig | None = None
    """As of the start of the run."""
    started_at_ns: int = 0
    finished_at_ns: int | None = None
    stages: list[StageRecord] = dataclasses.field(default_factory=list[StageRecord])
    versions: dict[Agent, dict[int, VersionRecord]] = dataclasses.field(
        default_factory=lambda: {agent: {} for agent in AGENTS}
    )
    """By agent and number, in the order they came."""
    evaluations: dict[tuple[str, str], EvaluationRecord] = dataclasses.field(
        default_factory=dict[tuple[str, str], EvaluationRecord]
    )
    """By (antagonist, protagonist) player reference, in the order planned."""
    evaluation_started_at_ns: int | None = None
    evaluation_done_at_ns: int | None = None
    incidents: list[IncidentRecord] = dataclasses.field(default_factory=list[IncidentRecord])
    leases: dict[str, LeaseRecord] = dataclasses.field(default_factory=dict[str, LeaseRecord])
    """Every lease ever granted, oldest first."""
    live_leases: dict[str, None] = dataclasses.field(default_factory=dict[str, None])
    """Ids of those that have not ended, oldest first."""
    ended_leases: list[str] = dataclasses.field(default_factory=list[str])
    """Ids in the order they ended."""
    result_names: set[str] = dataclasses.field(default_factory=set[str])
    """Names of all results messages in the ledger."""
    incident_keys: set[str] = dataclasses.field(default_factory=set[str])
    rollout_versions: dict[str, str] = dataclasses.field(default_factory=dict[str, str])
    """Which version (``agent:number``) each rollout name went into first."""
    repeated_rollouts: int = 0
    """Rollout names that a second version claimed too: 0 in a sound run."""
    model: str = ""
    """Hash of the simulator model of the bouts."""
    total_samples: dict[Agent, int] = dataclasses.field(
        default_factory=lambda: dict.fromkeys(AGENTS, 0)
    )
    """Samples each agent has learned from."""

    @classmethod
    def fold(cls, entries: Iterable[Entry]) -> "RunState":
        """Return the state after these events."""
        state = cls()
        for entry in entries:
            state.apply(entry)
        return state

    def apply(self, entry: Entry) -> None:
        """Take the next event in.

        Raises:
            ValueError: an event out of order, or one that does not follow from those before.
        """
        if entry.seq != self.position + 1:
            raise ValueError(f"event {entry.seq} follows event {self.position}; one is missing")
        try:
            self._take(entry.event, entry.at_ns)
        except (KeyError, IndexError) as error:
            raise ValueError(
                f"event {entry.seq} ({entry.event.kind} {entry.event.key}) names {error} "
                "that no earlier event made"
            ) from error
        self.position = entry.seq
        self.last_at_ns = entry.at_ns

    # What people ask of it ------------------------------------------------------------------

    @property
    def stage(self) -> StageRecord | None:
        """Return the stage that runs now, None between stages and after the last."""
        last = self.stages[-1] if self.stages else None
        return last if last is not None and last.ended_at_ns is None else None

    @property
    def finished(self) -> bool:
        """Return whether the run went to its end."""
        return self.finished_at_ns is not None

    @property
    def evaluation_done(self) -> int:
        """Return how many evaluation bouts have been played."""
        return sum(record.done for record in self.evaluations.values())

    @property
    def evaluation_total(self) -> int:
        """Return how many evaluation bouts are planned."""
        return sum(record.planned for record in self.evaluations.values())

    def latest(self, agent: Agent) -> VersionRecord | None:
        """Return the version of an agent with the highest number, None before version 0."""
        versions = self.versions[agent]
        return versions[max(versions)] if versions else None

    def latest_version(self, agent: Agent) -> int:
        """Return the highest version number of an agent, -1 before version 0."""
        return max(self.versions[agent], default=-1)

    def stage_ends(self, agent: Agent) -> list[StageRecord]:
        """Return the ended stages in which an agent learned, oldest first."""
        return [
            record
            for record in self.stages
            if record.stage.agent == agent and record.ended_at_ns is not None
        ]

    def player_label(self, ref: str) -> str:
        """Return a short name for a player reference, for tables and figures."""
        if ref.startswith("scripted:"):
            return ref.removeprefix("scripted:")
        for record in self.stages:
            if record.end_snapshot and ref == f"sha256:{record.end_snapshot}":
                return f"{record.stage.agent} {record.stage.iteration}"
        return ref.removeprefix("sha256:")[:8]

    # The fold -------------------------------------------------------------------------------

    def _take(self, event: events.Event, at_ns: int) -> None:
        match event:
            case events.RunStarted():
                self._run_started(event, at_ns)
            case events.StageStarted():
                self._stage_started(event, at_ns)
            case events.StageEnded():
                self._stage_ended(event, at_ns)
            case events.VersionEntered():
                self._version(event, at_ns)
            case events.LeaseGranted():
                self._lease_granted(event, at_ns)
            case events.LeaseEnded():
                self._lease_ended(event, at_ns)
            case events.BoutsPlayed():
                self._bouts(event, at_ns)
            case events.EvaluationPlanned():
                self._evaluation_planned(event, at_ns)
            case events.EvaluationDone():
                self.evaluation_done_at_ns = at_ns
            case events.IncidentNoted():
                self._incident(event)
            case events.RunFinished():
                self.finished_at_ns = at_ns
            case _:
                raise ValueError(f"event kind {event.kind!r} has no meaning here")

    def _run_started(self, event: events.RunStarted, at_ns: int) -> None:
        self.run, self.seed, self.serial = event.run, event.seed, event.serial
        self.config, self.started_at_ns = event.config, at_ns

    def _stage_started(self, event: events.StageStarted, at_ns: int) -> None:
        if event.stage.index != len(self.stages):
            raise ValueError(f"stage {event.stage.index} follows stage {len(self.stages) - 1}")
        self.stages.append(StageRecord(stage=event.stage, started_at_ns=at_ns))

    def _stage_ended(self, event: events.StageEnded, at_ns: int) -> None:
        record = self.stages[event.stage]
        record.ended_at_ns, record.end_reason = at_ns, event.reason
        record.end_version, record.end_snapshot = event.version, event.snapshot

    def _version(self, event: events.VersionEntered, at_ns: int) -> None:
        record = VersionRecord(
            agent=event.agent,
            version=event.version,
            stage=event.stage,
            snapshot=event.snapshot,
            rollouts=event.rollouts,
            metrics=event.metrics,
            at_ns=at_ns,
        )
        if event.stage >= 0:
            self.stages[event.stage].versions.append(record)
        self.versions[event.agent][event.version] = record
        if event.metrics is not None:
            self.total_samples[event.agent] = event.metrics.total_samples
        for name in event.rollouts:
            if self.rollout_versions.setdefault(name, event.key) != event.key:
                self.repeated_rollouts += 1

    def _lease_granted(self, event: events.LeaseGranted, at_ns: int) -> None:
        self.leases[event.lease] = LeaseRecord(grant=event, granted_at_ns=at_ns)
        self.live_leases[event.lease] = None

    def _lease_ended(self, event: events.LeaseEnded, at_ns: int) -> None:
        self.leases[event.lease] = dataclasses.replace(
            self.leases[event.lease], end_reason=event.reason, ended_at_ns=at_ns
        )
        del self.live_leases[event.lease]
        self.ended_leases.append(event.lease)

    def _bouts(self, event: events.BoutsPlayed, at_ns: int) -> None:
        self.result_names.add(event.name)
        self.model = self.model or event.model
        if event.stage < 0:
            self._evaluated(event)
            return
        record = self.stages[event.stage]
        for i, complete in enumerate(event.complete):
            if not complete:
                record.incomplete_bouts += 1
                continue
            record.complete_bouts += 1
            if not record.points or record.points[-1].update != record.updates:
                samples = sum(self.total_samples.values())
                record.points.append(CurvePoint(record.updates, samples, at_ns))
            point = record.points[-1]
            point.score.append(event.score[i])
            point.attack_steps.append(event.attack_steps[i])
            point.penalty_steps.append(event.penalty_steps[i])
            point.camping_steps.append(event.camping_steps[i])

    def _evaluated(self, event: events.BoutsPlayed) -> None:
        grant = self.leases[event.lease].grant
        record = self.evaluations[event.antagonist, event.protagonist]
        record.score.extend(event.score)
        record.attack_steps.extend(event.attack_steps)
        record.penalty_steps.extend(event.penalty_steps)
        record.camping_steps.extend(event.camping_steps)
        for bout in range(grant.first_bout, grant.first_bout + grant.bouts):
            record.played[bout] = True

    def _evaluation_planned(self, event: events.EvaluationPlanned, at_ns: int) -> None:
        self.evaluation_started_at_ns = at_ns
        for pairing in event.pairings:
            self.evaluations[pairing.antagonist, pairing.protagonist] = EvaluationRecord(
                antagonist=pairing.antagonist,
                protagonist=pairing.protagonist,
                planned=pairing.bouts,
                played=[False] * pairing.bouts,
            )

    def _incident(self, event: events.IncidentNoted) -> None:
        self.incident_keys.add(event.key)
        self.incidents.append(
            IncidentRecord(event.source, event.what, event.detail, event.reported_at_ns)
        )
