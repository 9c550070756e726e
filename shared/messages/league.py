"""What the league says to actors and learners, and they to it.

A *player reference* names who plays a side: ``sha256:<64 hex>`` for a snapshot,
``scripted:<name>`` for a scripted player.
"""

from typing import Annotated, Literal

import msgspec
import numpy as np

from shared.messages.message import Array, ArraySpec, Bytes, Message
from shared.messages.training import Agent

FEATURE_DIM = 8
"""Numbers that describe how a side moved in a bout."""


class Stage(Message, frozen=True, kw_only=True):
    """One period of the schedule, in which one agent learns against fixed opponents."""

    index: int
    """Counts all stages of the run from 0."""
    phase: str
    """``one``, ``two`` or ``evaluation``."""
    iteration: int
    """Iteration within the phase, from 1."""
    agent: Agent
    """Who learns."""
    opponent: str
    """Player reference of the other side."""
    max_updates: int
    """The learner's budget in this stage."""
    score_weight: float
    """Factor of the game score in the reward."""
    shaping_weight: float
    """Factor of the continuous reward."""
    round: int = 0
    """Round of phase two, from 1; 0 in phase one."""
    start: Literal["continue", "warm"] = "continue"
    """``warm``: the learner goes back to the end of phase one before it learns."""


class LeaseRequest(Message, frozen=True, kw_only=True):
    """An actor asks for work."""

    actor: str
    boot: str
    num_envs: int
    rollout_steps: int = 0
    """Control steps of its rollouts; 0 where it does not say."""


class Lease(Message, frozen=True, kw_only=True):
    """Work for one actor; it ends when its time runs out or the league says so."""

    lease: str
    """Empty when there is no work now: ask again."""
    kind: Literal["none", "train", "evaluate"]
    stage: Stage | None = None
    """The training stage (``kind == "train"``)."""
    antagonist: str = ""
    protagonist: str = ""
    """Player references (``kind == "evaluate"``)."""
    bouts: int = 0
    """Bouts to play from start to end (``kind == "evaluate"``)."""
    stochastic: bool = False
    """Sample the actions of frozen players instead of taking their mean."""
    seed: int = 0
    expires_in: float = 0.0
    """Seconds until it lapses unless renewed."""
    window: int = 1
    """Rollouts the actor may have unacknowledged."""
    reason: str = ""
    """Why there is no work, in one line."""


class LeaseRenewal(Message, frozen=True, kw_only=True):
    """An actor is still at it."""

    actor: str
    boot: str
    lease: str


class LeaseStatus(Message, frozen=True, kw_only=True):
    """Whether to go on."""

    alive: bool
    expires_in: float = 0.0
    window: int = 1


class LeaseSummary(Message, frozen=True, kw_only=True):
    """What a learner must know of a lease to check a rollout against it."""

    lease: str
    actor: str
    agent: Agent
    stage: int
    opponent: str
    seed: int
    boot: str = ""
    """Of the actor's process; empty where the league does not say."""


class Leases(Message, frozen=True, kw_only=True):
    """Who may hand rollouts over; grows with the actors, so that actors do not hear it."""

    leases: tuple[LeaseSummary, ...]
    """Training leases that are alive, and those ended a moment ago."""


class Schedule(Message, frozen=True, kw_only=True):
    """Where the run stands; everybody hears it, so that it is as long for any number of actors."""

    stage: Stage | None
    """None between stages and while evaluations are played."""
    versions: dict[str, int]
    """Newest version of each agent in the ledger."""
    finished: bool = False


class BoutResults(Message, frozen=True, kw_only=True):
    """Bouts that one actor finished under one lease, points split by the rule that gave them."""

    actor: str
    boot: str
    sequence: int
    """Counts the result messages of one boot from 0."""
    lease: str
    kind: Literal["train", "evaluate"]
    stage: int
    """-1 for evaluations."""
    antagonist: str
    protagonist: str
    """Player references; the learning side's is the version that ended the bout."""
    model: str
    seed: int
    bouts: Annotated[Array, ArraySpec("int64", ("K",))]
    score: Annotated[Array, ArraySpec("float32", ("K",))]
    """The antagonist's total."""
    attack_steps: Annotated[Array, ArraySpec("int32", ("K",))]
    """Steps that paid a point: in the target, no contact."""
    penalty_steps: Annotated[Array, ArraySpec("int32", ("K",))]
    """Steps that cost ten: in the target, bats touching."""
    camping_steps: Annotated[Array, ArraySpec("int32", ("K",))]
    """Steps that paid ten because the protagonist camped."""
    complete: Annotated[Array, ArraySpec("bool", ("K",))]
    """Played from step 0; only these count as scores."""
    features: Annotated[Array, ArraySpec("float32", ("F", 2, FEATURE_DIM))] = msgspec.field(
        default_factory=lambda: np.zeros((0, 2, FEATURE_DIM), np.float32)
    )
    """How both sides moved in each bout, antagonist first (``shared.styles.features``); measured
    in evaluations, no rows in training."""

    @property
    def name(self) -> str:
        """Return the name under which these results are acknowledged and recorded."""
        return f"{self.boot}:{self.sequence}"


class SnapshotRequest(Message, frozen=True, kw_only=True):
    """Asks the league for a snapshot by its reference."""

    snapshot: str


class SnapshotReply(Message, frozen=True, kw_only=True):
    """The snapshot, or why there is none."""

    found: bool
    payload: Annotated[Bytes, ArraySpec("uint8", ("B",))]
    reason: str = ""


class SettingsRequest(Message, frozen=True, kw_only=True):
    """An actor that has joined from elsewhere asks what it must play by."""

    actor: str


class RunSettings(Message, frozen=True, kw_only=True):
    """What every actor of a run must have the same of, wherever it runs."""

    toml: str
    """Sections of the run's site file: ``[sim]``, ``[game]``, ``[action]``, ``[reward]`` and
    ``[actor]``."""
    model: str = ""
    """Text of the model file, where ``[sim]`` names a file; empty for a shipped model."""


class Incident(Message, frozen=True, kw_only=True):
    """Something a report should mention: a process restarted, a rollout refused."""

    source: str
    """Service that reports it."""
    boot: str
    sequence: int
    kind: str
    """Past tense, fixed: ``process_restarted``, ``rollout_refused``, ``checkpoint_corrupt``, ..."""
    detail: str
    at_ns: int
    """Wall clock."""
