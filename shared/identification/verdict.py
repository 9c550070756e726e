"""What identification says at the end: ``verdict.json``, for programs and for the report."""

from typing import Literal

import msgspec

SCHEMA = 1
"""Of ``verdict.json``."""
NAMED_SHARE = 0.1
"""Of what a model leaves without an effect: what the effect takes off where it is named nine times
of ten (docs/identify_results.md)."""
NAMED_RATIO = (NAMED_SHARE / (1.0 - NAMED_SHARE)) ** 0.5
"""The same as a length: of what the effect does, by what is left without it."""
Word = Literal["named", "none", "tie", "base_too_coarse", "unexplained"]


class _Part(msgspec.Struct, frozen=True, kw_only=True):
    """Base of every part: frozen."""


class Interval(_Part, frozen=True, kw_only=True):
    """95 %."""

    low: float
    high: float


class Cause(_Part, frozen=True, kw_only=True):
    """An effect that passed the held-out gate, or one of a tie."""

    effect: str
    where: str
    """Joint, axis or part; empty: the whole arm."""
    quantity: str
    value: float
    unit: str
    interval: Interval
    title: str
    """In words."""
    signature: str
    others: dict[str, float] = {}
    """Further quantities of the same effect, by name."""
    other_units: dict[str, str] = {}
    """Theirs; older verdicts do not say."""
    other_intervals: dict[str, Interval] = {}
    """Of those that say how much, not how; older verdicts do not say."""
    share: float = 0.0
    """Of the explainable held-out residual, what is left more without it, all else fitted anew. Of
    one that is not told from another: what it takes off by itself."""
    share_interval: Interval | None = None


class Tie(_Part, frozen=True, kw_only=True):
    """Causes that these data do not tell apart."""

    causes: tuple[Cause, ...]
    alike: float
    """Smallest cosine between their signatures once what the base can absorb is taken out."""
    record: str
    """The motion that would tell them apart, in one sentence."""


class Unexplained(_Part, frozen=True, kw_only=True):
    """What is left over after everything that was named."""

    where: str
    """Joint, ``tracker``, or both."""
    trajectory: str
    begin: float
    """(s)."""
    end: float
    """(s)."""
    phase: str
    """In words: ``once``, ``after reversals`` (``of the load``), ``while fast``, ``while slow``,
    ``while loaded``, ``near a posture``, ``grows with time``, ``from a time on``, ``throughout``,
    ``at times``, ``again and again`` (like pushes, too often at one joint to be any)."""
    size: float
    """Root mean square there."""
    unit: str
    times_noise: float
    """Size in units of the noise floor."""
    torque: float | None = None
    """Joint torque that would do the same, root mean square; None behind the encoders."""
    torque_unit: str = ""
    is_external: bool = False
    """Whether it looks like something outside that pushed the arm: a torque of one sign that was
    missing for a moment, whatever the joint did."""


class HeldOut(_Part, frozen=True, kw_only=True):
    """Root-mean-square residual on held-out trajectories, in units of the noise floor (1 = noise).

    ``tracker_mm`` and ``joints_mrad`` are the same in plain units, by stage.
    """

    nominal: float
    base_fit: float
    extended: float
    noise_floor: float
    share_removed: float
    """(base_fit^2 - extended^2) / (base_fit^2 - noise_floor^2)."""
    share_interval: Interval
    joints_mrad: dict[str, float]
    """Keys ``nominal``, ``base_fit``, ``extended``, ``noise_floor``; mm for sliding joints."""
    tracker_mm: dict[str, float] = {}
    is_floor_measured: bool = True
    """Whether recordings that repeat each other measured the noise floor. Else 1 is what the base
    fit usually leaves (the median) of the motion that it was fitted to, in parts of a second."""
    by_all: float | None = None
    """What the extended model leaves once it is fitted to the held-out trajectories, too: what goes
    thereby is what the others did not show of it. None where that was not asked."""


class Scored(_Part, frozen=True, kw_only=True):
    """A candidate as it was looked at."""

    effect: str
    where: str
    screen: float
    """Share of the training residual that it takes off once the base's share is taken out."""
    gain: float | None = None
    """Held-out loss that it takes off when refitted; None where it was not refitted."""
    gain_interval: Interval | None = None
    value: float | None = None
    unit: str = ""
    why_not: str = ""
    """In words, of those that were not named."""


class Limit(_Part, frozen=True, kw_only=True):
    """From which size on an effect that was not named would have been, nine times of ten."""

    effect: str
    title: str
    """In words."""
    where: str
    quantity: str
    size: float | None
    """Either way; None where these recordings would not have shown any size that is looked for."""
    unit: str


class BaseValue(_Part, frozen=True, kw_only=True):
    """A parameter of the base model before and after."""

    name: str
    unit: str
    nominal: float
    base_fit: float
    extended: float
    interval: Interval


class Verdict(_Part, frozen=True, kw_only=True):
    """All of it."""

    schema: int = SCHEMA
    verdict: Word
    sentence: str
    """The verdict for people, in one or two sentences."""
    causes: tuple[Cause, ...]
    """In the order in which they were found, largest first. Those of a ``tie`` are beside it, each
    surely there itself; empty for any other verdict but ``named``."""
    ties: tuple[Tie, ...]
    unexplained: tuple[Unexplained, ...]
    held_out: HeldOut
    candidates: tuple[Scored, ...]
    """Best first."""
    ruled_out: dict[str, str]
    """Effects that could not be looked for, and why."""
    limits: tuple[Limit, ...] = ()
    """What the recordings would have shown of the other effects, by effect and place; empty where
    more is left than noise, and in older verdicts."""
    base: tuple[BaseValue, ...]
    caveats: tuple[str, ...]
    record_next: tuple[str, ...]
    """What to record next, best first, a sentence each."""
    starts_agree: bool
    """Whether base fits from several starts met."""
    dataset: str
    """SHA-256."""
    model: str
    seed: int
    version: str
    commit: str
    cpu_s: float
    seconds: dict[str, float]
    """CPU seconds by stage."""
    unlimited: tuple[str, ...] = ()
    """Joints whose drives were taken to give far more than the model file says."""
    timestep: float | None = None
    """Of the physics by which all of it was found (s); older verdicts do not say."""
