"""The state of a run, folded from the ledger's events.

``RunState.apply`` is the only way in: the running league, a restarted league and a report all
hold the same state because they applied the same events. Nothing here reads a clock or a file.
"""

import dataclasses
from collections.abc import Iterable

from services.league import events
from services.league.config import LeagueConfig
from services.league.events import Entry, LeaseEnd
from services.league.names import Names
from services.league.records import CurvePoint, StageRecord, VersionRecord, packed
from shared.messages.training import AGENTS, Agent

SCRIPTED_STATIC = "scripted:static"
ENDED_LEASES = 4096
"""Held at least where not everything is remembered: late results name one."""


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
    features: list[tuple[float, ...]] = dataclasses.field(default_factory=list[tuple[float, ...]])
    """Both sides' eight, antagonist first; empty in a ledger from before they were measured."""
    number: list[int] = dataclasses.field(default_factory=list[int])
    """Of each bout in the lists above, in the plan."""
    seed: list[int] = dataclasses.field(default_factory=list[int])
    """Of the batch each was played in."""
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
    """What the ledger says about a run: everything, or only what a running league needs."""

    remembers: int | None = dataclasses.field(default=None, compare=False)
    """At least so many of a stage's newest versions and points; None: all. The ledger has them."""
    position: int = 0
    """Sequence number of the last event applied."""
    last_at_ns: int = 0
    run: str = ""
    seed: int = 0
    serial: bool = False
    config: LeagueConfig | None = None
    """As of the start of the run, or of the last time it was taken up again."""
    started_at_ns: int = 0
    finished_at_ns: int | None = None
    ends: int = 0
    """How often the run was finished: more than once when it was taken up again."""
    stages: list[StageRecord] = dataclasses.field(default_factory=list[StageRecord])
    versions: dict[Agent, dict[int, VersionRecord]] = dataclasses.field(
        default_factory=lambda: {agent: {} for agent in AGENTS}
    )
    """By agent and number, in the order they came."""
    newest: dict[Agent, VersionRecord] = dataclasses.field(
        default_factory=dict[Agent, VersionRecord]
    )
    """By agent, the version with the highest number."""
    forgotten: dict[Agent, int] = dataclasses.field(default_factory=dict[Agent, int])
    """By agent, the highest number of a version that is not held any more."""
    evaluations: dict[tuple[str, str], EvaluationRecord] = dataclasses.field(
        default_factory=dict[tuple[str, str], EvaluationRecord]
    )
    """By (antagonist, protagonist) player reference, in the order planned."""
    evaluation_started_at_ns: int | None = None
    evaluation_done_at_ns: int | None = None
    incidents: list[IncidentRecord] = dataclasses.field(default_factory=list[IncidentRecord])
    leases: dict[str, LeaseRecord] = dataclasses.field(default_factory=dict[str, LeaseRecord])
    """Every lease ever granted, oldest first; none that ended long ago, if any are forgotten."""
    leases_granted: int = 0
    live_leases: dict[str, None] = dataclasses.field(default_factory=dict[str, None])
    """Ids of those that have not ended, oldest first."""
    live_leases_of: dict[str, list[str]] = dataclasses.field(default_factory=dict[str, list[str]])
    """The same by actor."""
    training_leases: int = 0
    """How many of those that have not ended are for training."""
    ended_leases: list[str] = dataclasses.field(default_factory=list[str])
    """Ids in the order they ended."""
    result_names: Names = dataclasses.field(default_factory=Names)
    """Names of all results messages in the ledger."""
    incident_keys: set[str] = dataclasses.field(default_factory=set[str])
    rollout_names: Names = dataclasses.field(default_factory=Names)
    """Names of all rollouts behind the versions in the ledger."""
    repeated_rollouts: int = 0
    """Rollout names that a second version claimed too: 0 in a sound run."""
    model: str = ""
    """Hash of the simulator model of the bouts."""
    total_samples: dict[Agent, int] = dataclasses.field(
        default_factory=lambda: dict.fromkeys(AGENTS, 0)
    )
    """Samples each agent has learned from."""

    @classmethod
    def fold(cls, entries: Iterable[Entry], remembers: int | None = None) -> "RunState":
        """Return the state after these events.

        Args:
            entries: the events, oldest first.
            remembers: at least so many of a stage's versions are kept; None: all.
        """
        state = cls(remembers=remembers)
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
    def is_tournament(self) -> bool:
        """Return whether the ledger began with an evaluation: nobody learns, no stages."""
        return not self.stages and self.evaluation_started_at_ns is not None

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
        return self.newest.get(agent)

    def latest_version(self, agent: Agent) -> int:
        """Return the highest version number of an agent, -1 before version 0."""
        return self.newest[agent].version if agent in self.newest else -1

    def stage_ends(self, agent: Agent, round: int | None = None) -> list[StageRecord]:
        """Return the ended stages in which an agent learned, oldest first.

        Args:
            agent: who.
            round: of phase two, 0 for phase one; all without it.
        """
        return [
            record
            for record in self.stages
            if record.stage.agent == agent
            and record.ended_at_ns is not None
            and round in (None, record.stage.round)
        ]

    def warm_start(self) -> tuple[str, str] | None:
        """Return antagonist and protagonist as phase one left them, None before both have."""
        antagonist, protagonist = (self.stage_ends(agent, 0) for agent in AGENTS)
        if not antagonist or not protagonist:
            return None
        return antagonist[-1].end_ref, protagonist[-1].end_ref

    def library(self) -> list[tuple[int, str, str]]:
        """Return round, antagonist and protagonist of every round that has been played out."""
        last = max((record.stage.round for record in self.stages), default=0)
        found: list[tuple[int, str, str]] = []
        for number in range(1, last + 1):
            antagonist, protagonist = (self.stage_ends(agent, number) for agent in AGENTS)
            if not antagonist or not protagonist:
                continue
            planned = (self.config or LeagueConfig()).round_iterations
            is_complete = protagonist[-1].stage.iteration >= planned
            if number < last or self.finished or is_complete:
                found.append((number, antagonist[-1].end_ref, protagonist[-1].end_ref))
        return found

    def player_label(self, ref: str) -> str:
        """Return a short name for a player reference, for tables and figures."""
        if ref.startswith("scripted:"):
            return ref.removeprefix("scripted:")
        for record in self.stages:
            if record.end_snapshot and ref == record.end_ref:
                return record.end_label
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
                self.ends += 1
            case events.RunReopened():
                self.finished_at_ns = None
                self.config = event.config
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
            agent=AGENTS[AGENTS.index(event.agent)],  # not a copy of the word for each version
            version=event.version,
            stage=event.stage,
            snapshot=event.snapshot,
            numbers=packed(event.metrics),
            at_ns=at_ns,
        )
        if event.stage >= 0:
            stage = self.stages[event.stage]
            stage.add(record)
            stage.restarts += not event.rollouts
        self.model = self.model or event.model
        self.versions[record.agent][event.version] = record
        if event.version > self.latest_version(record.agent):
            self.newest[record.agent] = record
        if event.metrics is not None:
            self.total_samples[event.agent] = event.metrics.total_samples
        for name in set(event.rollouts):
            self.repeated_rollouts += not self.rollout_names.add(name)
        if event.stage >= 0:
            self._forget(self.stages[event.stage])

    def _forget(self, record: StageRecord) -> None:
        """Let go of a stage's oldest versions, half of them at a time."""
        if self.remembers is not None and len(record.versions) >= 2 * self.remembers:
            for old in record.forget(self.remembers):
                self.versions[old.agent].pop(old.version, None)
                known = self.forgotten.get(old.agent, -1)
                self.forgotten[old.agent] = max(known, old.version)

    def _lease_granted(self, event: events.LeaseGranted, at_ns: int) -> None:
        self.leases[event.lease] = LeaseRecord(grant=event, granted_at_ns=at_ns)
        self.leases_granted += 1
        self.live_leases[event.lease] = None
        self.live_leases_of.setdefault(event.actor, []).append(event.lease)
        self.training_leases += event.work == "train"

    def _lease_ended(self, event: events.LeaseEnded, at_ns: int) -> None:
        self.leases[event.lease] = dataclasses.replace(
            self.leases[event.lease], end_reason=event.reason, ended_at_ns=at_ns
        )
        del self.live_leases[event.lease]
        granted = self.leases[event.lease].grant
        self.training_leases -= granted.work == "train"
        own = self.live_leases_of[granted.actor]
        own.remove(event.lease)
        if not own:
            del self.live_leases_of[granted.actor]
        self.ended_leases.append(event.lease)
        if self.remembers is not None and len(self.ended_leases) >= 2 * ENDED_LEASES:
            for lease in self.ended_leases[:ENDED_LEASES]:
                del self.leases[lease]
            del self.ended_leases[:ENDED_LEASES]

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
            record.points[-1].score.append(event.score[i])

    def _evaluated(self, event: events.BoutsPlayed) -> None:
        grant = self.leases[event.lease].grant
        record = self.evaluations[event.antagonist, event.protagonist]
        record.score.extend(event.score)
        record.attack_steps.extend(event.attack_steps)
        record.penalty_steps.extend(event.penalty_steps)
        record.camping_steps.extend(event.camping_steps)
        record.features.extend(event.features)
        record.seed.extend([grant.seed] * grant.bouts)
        for bout in range(grant.first_bout, grant.first_bout + grant.bouts):
            record.played[bout] = True
            record.number.append(bout)

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
