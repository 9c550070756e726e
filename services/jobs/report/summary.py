"""The numbers of a run: what ``summary.json`` holds and the report shows."""

import msgspec

from services.jobs.report.rounds import RoundSummary

SCHEMA = 1
LOWERS_GOAL = 1500.0
"""Points a bout that a trained protagonist must take off the antagonist it trained against."""
RECOVERS_GOAL = 1000.0
"""Points a bout that the antagonist trained after must win back from that protagonist."""


class Frozen(msgspec.Struct, frozen=True, kw_only=True):
    """Base of what is in ``summary.json``."""


class Score(Frozen, frozen=True, kw_only=True):
    """A mean over bouts with its 95 % bootstrap interval, in points a bout."""

    mean: float
    low: float
    high: float
    bouts: int


class Curve(Frozen, frozen=True, kw_only=True):
    """The antagonist's mean score over one stage."""

    samples: tuple[float, ...]
    """Samples both agents had learned from, over the whole run."""
    mean: tuple[float, ...]
    low: tuple[float, ...]
    high: tuple[float, ...]


class StageSummary(Frozen, frozen=True, kw_only=True):
    """One stage of phase one."""

    index: int
    iteration: int
    agent: str
    opponent: str
    updates: int
    max_updates: int
    samples: int
    samples_before: int
    """That both agents had learned from when it began."""
    seconds: float
    ended: str
    """``converged``, ``budget``, or ``no`` while it runs."""
    complete_bouts: int
    first: Score | None
    """Over the first tenth of its bouts, 64 at least."""
    last: Score | None
    """Over the last tenth."""
    approx_kl: float
    """Means over its updates."""
    clip_fraction: float
    explained_variance: float
    policy_lag: float
    curve: Curve


class Meeting(Frozen, frozen=True, kw_only=True):
    """One pairing of the evaluation."""

    antagonist: str
    protagonist: str
    antagonist_player: str
    protagonist_player: str
    """Player references."""
    bouts: int
    planned: int
    score: Score | None
    attack_points: float
    """Means a bout."""
    penalty_points: float
    camping_points: float
    camping_share: float
    """Of all points given and taken, how much camping gave."""
    in_target_share: float
    """Of all steps, those with the antagonist's bat in the target."""


class Difference(Frozen, frozen=True, kw_only=True):
    """What a stage of training changed, in points a bout."""

    kind: str
    """``lowers`` or ``recovers``."""
    iteration: int
    text: str
    score: Score
    goal: float
    met: bool
    """The mean reaches the goal."""
    certain: bool
    """The whole interval does."""


class IncidentSummary(Frozen, frozen=True, kw_only=True):
    """Something that happened."""

    seconds: float
    """After the run began."""
    source: str
    what: str
    detail: str


class Origin(Frozen, frozen=True, kw_only=True):
    """What made the run."""

    command: str
    commit: str
    packages: dict[str, str]
    python: str
    machine: str


class Summary(Frozen, frozen=True, kw_only=True):
    """A whole run."""

    schema: int = SCHEMA
    run: str
    folder: str
    finished: bool
    seed: int
    serial: bool
    model: str
    started_at: str
    seconds: float
    training_seconds: float
    evaluation_seconds: float
    first_update_seconds: float
    """From the league's start to the first learned version; -1 before it."""
    samples: int
    samples_per_s: float
    """While stages ran."""
    updates: int
    bout_seconds: float
    stages: tuple[StageSummary, ...]
    """Of phase one."""
    rounds: tuple[RoundSummary, ...] = ()
    """Of phase two."""
    meetings: tuple[Meeting, ...]
    differences: tuple[Difference, ...]
    headline_differences: tuple[Difference, ...]
    """The two that the goals speak of."""
    incidents: tuple[IncidentSummary, ...]
    incident_counts: dict[str, int]
    leases_lapsed: int
    repeated_rollouts: int
    """Rollouts that were learned from twice: 0 in a sound run."""
    origin: Origin
