"""What the pictures of a finding are drawn from: arrays and names, nothing that simulates.

The numbers that count are in the :class:`~shared.identification.verdict.Verdict`; these arrays show
where they come from.
"""

from dataclasses import dataclass, field
from typing import Literal, get_args

from shared.identification.dataset.types import Float64, Split

Stage = Literal["nominal", "base_fit", "extended"]
"""The model as it was given, with its base parameters fitted, and with the causes in it."""
STAGES: tuple[Stage, ...] = get_args(Stage)


@dataclass(frozen=True)
class Replay:
    """One trajectory as it was measured and as each stage of the model replays it.

    Where no cause was named, ``extended`` is the same as ``base_fit``.
    """

    name: str
    split: Split
    at: Float64
    """float64[T], instants of the joint log (s)."""
    q: Float64
    """float64[T, J], measured (rad, m)."""
    predicted: dict[Stage, Float64]
    """float64[T, J] each; NaN from where the physics diverged."""
    loss: dict[Stage, float]
    """Root-mean-square residual in units of the noise floor, as in the verdict."""
    begins: float = 0.0
    """How long the arm had been recorded before (s)."""
    effort: Float64 | None = None
    """float64[T, J], torque as it was logged or commanded, else as the model says that the motion
    takes it (N m, N)."""
    tracker_at: Float64 | None = None
    """float64[K] (s)."""
    tracker: Float64 | None = None
    """float64[K, 7], measured poses in the base frame (m; w x y z)."""
    tracked: dict[Stage, Float64] = field(default_factory=dict[Stage, Float64])
    """float64[K, 7] each, as the model predicts that the tracker logs them."""
    by_encoders: Float64 | None = None
    """float64[K, 7], where the tool is by the logged joints and the nominal kinematics."""


@dataclass(frozen=True)
class Profile:
    """Mean residual of the base fit over bins of something, one row a joint."""

    over: str
    """``velocity``, ``position``, ``effort`` or ``time``."""
    unit: str
    """Of the bins."""
    centres: Float64
    """float64[J, B], of the bins; a joint's bins span its own range."""
    mean: Float64
    """float64[J, B], measured minus predicted (rad, m); NaN where a bin is empty."""
    rms: Float64
    """float64[J, B]."""


@dataclass(frozen=True)
class Sides:
    """Whether what is off is off before the encoders already, or only behind them.

    Before them are commands, controller, drives, friction and loads; behind them are links that
    give, encoders that are wrong, frames, the tracker and its clock. All root mean square.
    """

    joints: float
    """Residual of the joint that is furthest off, in units of its noise floor."""
    tracker: tuple[float, float]
    """Tracker less simulated tracker (m, rad)."""
    behind: tuple[float, float]
    """Tracker less forward kinematics of the logged joints (m, rad)."""
    behind_noise: float
    """The larger part of ``behind``, in units of the tracker's noise floor."""
    where: Literal["before the encoders", "behind the encoders", "both", "neither"]


@dataclass(frozen=True)
class Diagnostics:
    """How the residual of the base fit looks; nothing is decided by it."""

    profiles: tuple[Profile, ...]
    forward: Float64
    """float64[J], mean residual while a joint goes up (rad, m)."""
    backward: Float64
    """float64[J], while it goes down."""
    lag: dict[str, float]
    """By channel, a joint or ``tracker``: by how much measured motion is behind predicted (s)."""
    frequency: Float64
    """float64[F], centres of the bands (Hz)."""
    spectrum: Float64
    """float64[J, F], root-mean-square residual in each band (rad, m)."""
    sides: Sides | None = None
    """None without a tracker or a noise floor."""


@dataclass(frozen=True)
class Evidence:
    """Everything the report draws; screening scores are the verdict's ``candidates``."""

    joints: tuple[str, ...]
    """In the order of every array."""
    units: tuple[str, ...]
    """Of each joint: ``rad`` or ``m``."""
    noise: Float64
    """float64[J], noise floor of each joint, root mean square (rad, m)."""
    tracker_noise: tuple[float, float] | None
    """The same of the tracker: position (m), orientation (rad), the three axes together."""
    noise_from_repeats: bool
    """Whether the noise floor is from recordings that repeat each other, else from the residual."""
    replays: tuple[Replay, ...]
    """All trajectories but repeats, in the order of the data set."""
    diagnostics: Diagnostics
    """See :func:`shared.identification.conclusion.diagnose.diagnose`."""
    is_in_parts: bool = False
    """Whether the arm is set anew where it was, again and again, as nothing else brings it back."""

    @property
    def held_out(self) -> tuple[Replay, ...]:
        """Return the trajectories that nothing was fitted to."""
        return tuple(each for each in self.replays if each.split == "test")
