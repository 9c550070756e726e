"""What the ledger records: one struct for each kind of event.

An event is immutable once written, and (kind, key) names it for ever. Evolve by adding fields
with defaults and new kinds; never rename, retype or remove one.
"""

import dataclasses
from typing import Any, ClassVar, Literal

import msgspec

from services.league.config import LeagueConfig
from shared.messages.league import Stage
from shared.messages.training import Agent, UpdateMetrics


class Event(msgspec.Struct, frozen=True, kw_only=True):
    """Base of all events."""

    kind: ClassVar[str] = ""

    @property
    def key(self) -> str:
        """Return what tells this event from others of its kind."""
        raise TypeError("an event of no kind has no key")


class RunStarted(Event, frozen=True, kw_only=True):
    """The first event of every ledger."""

    kind: ClassVar[str] = "run_started"
    run: str
    seed: int
    serial: bool
    config: LeagueConfig

    @property
    def key(self) -> str:
        """Return the one key, so that a ledger has one start."""
        return "run"


class StageStarted(Event, frozen=True, kw_only=True):
    """One agent learns from now on."""

    kind: ClassVar[str] = "stage_started"
    stage: Stage

    @property
    def key(self) -> str:
        """Return the index of the stage."""
        return str(self.stage.index)


class StageEnded(Event, frozen=True, kw_only=True):
    """A stage is over; ``snapshot`` is what its agent had learned by then."""

    kind: ClassVar[str] = "stage_ended"
    stage: int
    reason: Literal["converged", "budget"]
    version: int
    snapshot: str
    """Content hash."""

    @property
    def key(self) -> str:
        """Return the index of the stage."""
        return str(self.stage)


class VersionEntered(Event, frozen=True, kw_only=True):
    """A learner's version is in the ledger, its snapshot in the store."""

    kind: ClassVar[str] = "version"
    agent: Agent
    version: int
    stage: int
    """-1 for a version made outside any stage (version 0)."""
    snapshot: str
    """Content hash."""
    rollouts: tuple[str, ...]
    metrics: UpdateMetrics | None
    model: str = ""
    """Hash of the simulator model that the snapshot is made for."""

    @property
    def key(self) -> str:
        """Return agent and number."""
        return f"{self.agent}:{self.version}"


class LeaseGranted(Event, frozen=True, kw_only=True):
    """An actor got work."""

    kind: ClassVar[str] = "lease_granted"
    lease: str
    number: int
    actor: str
    boot: str
    work: Literal["train", "evaluate"]
    stage: int
    """-1 for an evaluation."""
    antagonist: str
    protagonist: str
    """Player references; empty for the side that learns."""
    first_bout: int = 0
    """Of the pairing, in an evaluation."""
    bouts: int = 0
    """How many, in an evaluation."""
    seed: int
    rollout_samples: int = 0
    """In one rollout of the actor; 0 where it did not say."""

    @property
    def key(self) -> str:
        """Return the lease's id."""
        return self.lease


LeaseEnd = Literal["completed", "lapsed", "stage_ended", "asked_again", "restarted", "superseded"]


class LeaseEnded(Event, frozen=True, kw_only=True):
    """A lease is over."""

    kind: ClassVar[str] = "lease_ended"
    lease: str
    reason: LeaseEnd

    @property
    def key(self) -> str:
        """Return the lease's id."""
        return self.lease


class BoutsPlayed(Event, frozen=True, kw_only=True):
    """One results message: K bouts played under one lease."""

    kind: ClassVar[str] = "bouts"
    name: str
    """``boot:sequence`` of the message."""
    actor: str
    lease: str
    stage: int
    """-1 for an evaluation."""
    antagonist: str
    protagonist: str
    model: str
    bouts: tuple[int, ...]
    score: tuple[float, ...]
    attack_steps: tuple[int, ...]
    penalty_steps: tuple[int, ...]
    camping_steps: tuple[int, ...]
    complete: tuple[bool, ...]
    features: tuple[tuple[float, ...], ...] = ()
    """Of each bout of an evaluation: the antagonist's eight, then the protagonist's."""

    @property
    def key(self) -> str:
        """Return the name under which the message was acknowledged."""
        return self.name


class Pairing(msgspec.Struct, frozen=True, kw_only=True):
    """Two players that meet in an evaluation."""

    antagonist: str
    protagonist: str
    bouts: int


class EvaluationPlanned(Event, frozen=True, kw_only=True):
    """Who meets whom, how often."""

    kind: ClassVar[str] = "evaluation_planned"
    plan: int
    """Counts the evaluations of a run from 0."""
    pairings: tuple[Pairing, ...]

    @property
    def key(self) -> str:
        """Return the number of the plan."""
        return str(self.plan)


class EvaluationDone(Event, frozen=True, kw_only=True):
    """Every bout of a plan has been played."""

    kind: ClassVar[str] = "evaluation_done"
    plan: int

    @property
    def key(self) -> str:
        """Return the number of the plan."""
        return str(self.plan)


class IncidentNoted(Event, frozen=True, kw_only=True):
    """Something the report should mention."""

    kind: ClassVar[str] = "incident"
    source: str
    boot: str
    sequence: int
    what: str
    """Past tense, fixed: ``process_restarted``, ..."""
    detail: str
    reported_at_ns: int
    """By the reporter's wall clock."""

    @property
    def key(self) -> str:
        """Return who reported it and its number there."""
        return f"{self.source}:{self.boot}:{self.sequence}"


class RunFinished(Event, frozen=True, kw_only=True):
    """The run went to its end; the last event, unless the run is taken up again."""

    kind: ClassVar[str] = "run_finished"
    number: int = 0
    """How often the run had been finished before."""

    @property
    def key(self) -> str:
        """Return the one key, or that of a later end."""
        return f"run:{self.number}" if self.number else "run"


class RunReopened(Event, frozen=True, kw_only=True):
    """A finished run goes on: its settings ask for more than it had played."""

    kind: ClassVar[str] = "run_reopened"
    number: int
    """Counts from 1."""
    config: LeagueConfig

    @property
    def key(self) -> str:
        """Return the number."""
        return str(self.number)


EVENTS: tuple[type[Event], ...] = (
    RunStarted,
    StageStarted,
    StageEnded,
    VersionEntered,
    LeaseGranted,
    LeaseEnded,
    BoutsPlayed,
    EvaluationPlanned,
    EvaluationDone,
    IncidentNoted,
    RunFinished,
    RunReopened,
)
_BY_KIND = {event.kind: event for event in EVENTS}


@dataclasses.dataclass(frozen=True)
class Entry:
    """An event at its place in the ledger."""

    seq: int
    """From 1, without gaps."""
    at_ns: int
    """Wall clock of the league."""
    event: Event


def encode_event(event: Event) -> bytes:
    """Return the JSON body of an event."""
    return msgspec.json.encode(event)


def decode_event(kind: str, body: str | bytes) -> Event:
    """Return the event of a kind from its JSON body.

    Raises:
        ValueError: an unknown kind, or a body that is not one.
    """
    event: type[Any] | None = _BY_KIND.get(kind)
    if event is None:
        raise ValueError(f"event kind {kind!r} is unknown; a newer Riposte wrote it")
    try:
        return msgspec.json.decode(body, type=event)
    except RecursionError as error:
        raise ValueError(f"the body of a {kind} is nested too deeply") from error
