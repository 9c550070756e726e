"""A recording programme: which motions, how long, as large and as fast as the limits let them.

Eight recordings, of which two are held out and one repeats another. Each is made at full size,
simulated on the nominal model, and made smaller until places, speeds, efforts and the way that the
tool lags behind its command are all within the limits.
"""

import itertools
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final, Literal

import numpy as np

from shared.errors import IdentificationError
from shared.identification.arm.motion import motion_of
from shared.identification.dataset.types import POSE, Dataset, Float64, Split, Trajectory
from shared.identification.excitation import motions
from shared.identification.excitation.arm import Arm
from shared.identification.excitation.limits import Limits, hurry, is_inside, strain
from shared.sim.plant.inverse import inverse_dynamics
from shared.sim.plant.replay import Recorded, Reports
from shared.sim.plant.signals import Signal, pose_error

SHORTEST: Final = 40.0
"""Of all recordings together (s)."""
LONGEST: Final = 600.0
"""(s)."""
_MARGIN: Final = 0.02
"""That the tool keeps from the limits of where it may go (m)."""
_ROUNDS: Final = 24
_SMALLER: Final = 0.85
_LARGEST_STEP: Final = 0.93
"""Closest to 1 that a size shrinks by at a time."""
_SMALLEST: Final = 0.05
_CRAWL: Final = 0.025
"""Of the slow half of a crawl (rad/s); the other half goes at 0.1."""
_HIGHEST: Final = 9.0
"""Of a chirp (Hz)."""

Kind = Literal["postures", "crawl", "sines", "swings", "chirp"]


@dataclass(frozen=True)
class Plan:
    """One recording before it is made."""

    name: str
    kind: Kind
    share: float
    """Of all the time (1)."""
    split: Split = "train"
    repeats: str = ""
    draw: int = 0
    """Recordings of one kind with another draw are other motions."""


PLANS: Final = (
    Plan("postures", "postures", 0.22),
    Plan("crawl", "crawl", 0.14),
    Plan("sines", "sines", 0.13),
    Plan("swings", "swings", 0.13),
    Plan("chirp", "chirp", 0.08),
    Plan("sines_again", "sines", 0.13, repeats="sines"),
    Plan("other_sines", "sines", 0.08, split="test", draw=1),
    Plan("other_swings", "swings", 0.09, split="test", draw=1),
)
SHOWS: Final[dict[Kind, str]] = {
    "postures": "weight, counterbalance, offsets and frames: held with a little dither",
    "crawl": "friction near standstill, backlash, ripple",
    "sines": "damping, inertia and lag over the workspace",
    "swings": "saturation, gains and lag at speed, and what rings after a stop",
    "chirp": "elasticity and the controller's period",
}


@dataclass(frozen=True)
class Part:
    """One recording of a programme."""

    plan: Plan
    at: Float64
    """float64[C] (s)."""
    q: Float64
    """float64[C, J], postures that the command is made of (rad, m)."""
    command: Float64
    """float64[C, U]."""
    size: Float64
    """float64[J], of what it would be without limits (1)."""


@dataclass(frozen=True)
class Programme:
    """All recordings, and what they would log on the nominal arm."""

    arm: Arm
    parts: tuple[Part, ...]
    predicted: Dataset
    effort: Float64
    """float64[parts, J], largest share of each joint's torque limit (1); 0 where unknown."""
    lead: Float64
    """float64[parts, 2], furthest that a pose is ahead of the tool (m, rad), else 0."""

    @property
    def seconds(self) -> float:
        """Return how long all recordings take (s)."""
        return float(sum(part.at[-1] + motions.PERIOD for part in self.parts))


def design(arm: Arm, seconds: float, seed: int) -> Programme:
    """Return a programme of about so many seconds.

    Args:
        arm: what is moved.
        seconds: of all recordings together.
        seed: of everything random; the same seed gives the same programme.

    Raises:
        IdentificationError: no motion fits within the limits, or the time is out of range.
    """
    if not SHORTEST <= seconds <= LONGEST:
        raise IdentificationError(
            f"a programme of {seconds:g} s: {SHORTEST:g} to {LONGEST:g} s can be planned"
        )
    still = arm.poses(arm.home[None])
    if not is_inside(arm.limits, arm.home[None], still, _MARGIN):
        place = ", ".join(f"{value:.2f}" for value in still[0, :3])
        raise IdentificationError(
            f"the tool begins at ({place}) m, which is outside the limits or within {_MARGIN} m of "
            "them: widen --safe-box, or move the arm's home"
        )
    own = [plan for plan in PLANS if not plan.repeats]
    sizes = {plan.name: np.ones(len(arm.home)) for plan in own}
    parts: dict[str, Part] = {}
    for _ in range(_ROUNDS):
        for plan in own:
            if plan.name not in parts:
                parts[plan.name] = _part(arm, plan, seconds, seed, sizes[plan.name])
        waiting = [parts[plan.name] for plan in own]
        is_done = True
        for part, judged in zip(waiting, _judged(arm, waiting), strict=True):
            if judged.excess > 1.0 or np.any(judged.strain > 1.0):
                is_done = False
                smaller = part.size * _shrunk(np.maximum(judged.strain, judged.excess))
                sizes[part.plan.name] = smaller
                del parts[part.plan.name]
                _check_size(part.plan, smaller)
        if is_done:
            return _programme(arm, parts)
    raise IdentificationError("no motion was found within the limits")


def _shrunk(excess: Float64 | float) -> Float64:
    """Return factors of size for what is so many times too much; 1 where it is not."""
    factors = np.clip(0.97 / np.maximum(excess, 1e-9), 0.5, _LARGEST_STEP)
    return np.where(np.asarray(excess) > 1.0, factors, 1.0)


def _check_size(plan: Plan, size: Float64) -> None:
    if size.max() < _SMALLEST:
        raise IdentificationError(
            f"{plan.name}: even a twentieth of the motion is too much for the nominal arm: it "
            "leaves its range, its torque or the way it may lag; under torque control that is an "
            "arm that does not hold itself"
        )


def _part(arm: Arm, plan: Plan, seconds: float, seed: int, size: Float64) -> Part:
    """Return a recording, at most of a size, that is where it may be and slow enough."""
    room = 1.0
    while min(float(size.max()), room) >= _SMALLEST:
        rng = np.random.default_rng([seed, plan.draw, len(plan.kind)])
        q = arm.home + _relative(arm, plan, plan.share * seconds, size, room * arm.reach, rng)
        poses = arm.poses(q)
        if not is_inside(arm.limits, q, poses, _MARGIN):
            room *= _SMALLER
        elif (times := hurry(arm.limits, q, poses, motions.PERIOD)) > 1.0:
            size = size * _shrunk(times)
        else:
            at = motions.PERIOD * np.arange(len(q), dtype=np.float64)
            return Part(plan, at, q, _command(arm, q, poses), size)
    raise IdentificationError(
        f"{plan.name}: even a twentieth of the motion leaves the limits; widen --safe-box"
    )


def _relative(
    arm: Arm, plan: Plan, seconds: float, size: Float64, reach: Float64, rng: np.random.Generator
) -> Float64:
    """Return float64[C, J], a motion relative to home.

    Args:
        arm: what is moved.
        plan: which motion.
        seconds: how long.
        size: float64[J], of oscillation; the least is that of the pace between postures.
        reach: float64[J], furthest from home.
        rng: what is drawn from.
    """
    if plan.kind == "sines":
        return motions.sines(seconds, size * reach, rng)
    if plan.kind == "crawl":
        return motions.crawl(seconds, float(size.min()) * _CRAWL, reach, rng)
    if plan.kind == "chirp":
        return motions.chirp(seconds, _HIGHEST, size * reach, rng)
    if plan.kind == "postures":
        count = int(np.clip(seconds / 2.5, 6, 9))
        postures = _inside(arm, motions.spread(count, reach, rng))
        limits, ends = arm.limits.within(0.7 * float(size.min())), 0.5
    else:
        postures = _inside(arm, motions.far(200, reach, rng))
        # the last stop is long enough for what rings
        limits, ends = arm.limits.within(0.95 * float(size.min())), min(1.5, 0.15 * seconds)
    lengths = _Lengths(arm, limits)
    if plan.kind == "swings":
        moving = seconds - ends - 0.2
        first = postures[:2]
        postures = _that_fit(postures * _nearer(lengths.tour(first), moving), lengths, moving)
        dwell = np.full(len(postures) + 1, _DWELL)
        dither = 0.0
    else:
        moving = seconds - ends - 0.2 - _REST * len(postures)
        postures = postures * _nearer(lengths.tour(postures), moving)
        rest = max(moving - lengths.tour(postures), 0.0) / len(postures) + _REST
        dwell = np.full(len(postures) + 1, rest)
        dither = motions.DITHER * float(size.min()) ** 2
    dwell[-1] = ends
    return motions.visits(postures, dwell, lengths, dither, rng)


_DWELL: Final = 0.15
"""Of a swing's end (s)."""
_REST: Final = 0.9
"""Shortest that a posture is held (s)."""


@dataclass(frozen=True)
class _Lengths:
    """How long the ways between postures take at limits."""

    arm: Arm
    limits: Limits

    def __call__(self, start: Float64, end: Float64) -> float:
        way = np.r_[np.zeros(1), motions.minimum_jerk(0.5)]
        q = self.arm.home + start + way[:, None] * (end - start)
        # taken in one second; the answer is how many it has to take
        return max(hurry(self.limits, q, self.arm.poses(q), 1.0 / (len(way) - 1)), 0.2)

    def tour(self, postures: Float64) -> float:
        """Return the time from home by all postures and back (s)."""
        home = np.zeros((1, postures.shape[1]))
        stops = np.concatenate([home, postures, home])
        return sum(self(start, end) for start, end in itertools.pairwise(stops))


def _nearer(needed: float, given: float) -> float:
    """Return how much nearer postures must be to be visited in a given time (s); no more than 1."""
    return float(np.clip(given / needed, _SMALLEST, 1.0))


def _that_fit(postures: Float64, lengths: _Lengths, seconds: float) -> Float64:
    """Return as many postures from the first as can be visited in a time, at least two."""
    home = np.zeros(postures.shape[1])
    used, here = 0.0, home
    for index, there in enumerate(postures):
        used += lengths(here, there) + _DWELL
        if used + lengths(there, home) > seconds and index >= 2:
            return postures[:index]
        here = there
    return postures


def _inside(arm: Arm, postures: Float64) -> Float64:
    """Return postures, each drawn towards home until the tool is where it may be."""
    out = postures.copy()
    tool = arm.limits.tool
    if tool is None:
        return out
    for _ in range(_ROUNDS):
        is_out = tool.clearance(arm.poses(arm.home + out)) < 2.0 * _MARGIN
        if not is_out.any():
            break
        out[is_out] *= _SMALLER
    return out


def _command(arm: Arm, q: Float64, poses: Float64) -> Float64:
    """Return what makes the arm move so, as its control takes it."""
    if arm.plant.control == "pose":
        return poses
    if arm.plant.control == "position":
        return q
    qd = np.gradient(q, motions.PERIOD, axis=0)
    qdd = np.gradient(qd, motions.PERIOD, axis=0)
    return inverse_dynamics(arm.plant, arm.rollouts.model, q, qd, qdd)


@dataclass(frozen=True)
class _Judged:
    """What a recording does to the nominal arm."""

    reports: Reports
    efforts: Float64
    """float64[J], largest share."""
    lead: Float64
    """float64[2] (m, rad)."""
    strain: Float64
    """float64[J], of each joint; above 1 is too much."""
    excess: float
    """Of everything else."""


def _judged(arm: Arm, parts: list[Part]) -> list[_Judged]:
    found = arm.rollouts.run([(lambda row: None, _recorded(arm, part)) for part in parts])
    return [_judge(arm, part, reports) for part, reports in zip(parts, found, strict=True)]


def _judge(arm: Arm, part: Part, reports: Reports) -> _Judged:
    assert reports.tracker is not None
    limits, tool = arm.limits, arm.limits.tool
    if not np.isfinite(reports.q).all():
        return _Judged(
            reports, np.zeros(len(arm.home)), np.zeros(2), np.zeros(len(arm.home)), np.inf
        )
    motion = motion_of(_trajectory(arm, part, reports))
    efforts = inverse_dynamics(arm.plant, arm.rollouts.model, motion.q, motion.qd, motion.qdd)
    excess = [0.0]
    slack = 0.02 + 0.1 * (limits.high - limits.low)
    if np.any(reports.q < limits.low - slack) or np.any(reports.q > limits.high + slack):
        excess.append(np.inf)
    lead = np.zeros(2)
    if tool is not None:
        if float(tool.clearance(reports.tracker).min()) < 0.0:
            excess.append(np.inf)
        if arm.plant.control == "pose":
            error = pose_error(part.command, reports.tracker)
            lead = np.array([np.linalg.norm(error[:, :3], axis=1).max(),
                             np.linalg.norm(error[:, 3:], axis=1).max()])  # fmt: skip
            excess += [float(lead[0] / tool.lead), float(lead[1] / tool.turn_lead)]
    shares = np.abs(efforts).max(axis=0) / limits.effort
    strained = strain(limits, efforts, motions.PERIOD)
    return _Judged(reports, shares, lead, strained, float(max(excess)))


def _recorded(arm: Arm, part: Part) -> Recorded:
    return Recorded(
        initial_q=part.q[0],
        initial_qd=np.zeros_like(part.q[0]),
        command=Signal(part.at, part.command),
        logged_q=Signal(part.at, part.q),
        joints_at=part.at,
        tracker_at=part.at,
        trajectory=part.plan.name,
    )


def _trajectory(arm: Arm, part: Part, reports: Reports) -> Trajectory:
    return Trajectory(
        name=part.plan.name,
        split=part.plan.split,
        repeats=part.plan.repeats,
        initial_q=part.q[0],
        initial_qd=np.zeros_like(part.q[0]),
        command_at=part.at,
        command=part.command,
        joints_at=part.at,
        q=reports.q,
        tracker_at=part.at,
        tracker=reports.tracker,
    )


def _programme(arm: Arm, parts: dict[str, Part]) -> Programme:
    """Return all recordings in the order of the plan, the repeat among them."""
    ordered = [replace(parts[plan.repeats or plan.name], plan=plan) for plan in PLANS]
    judged = _judged(arm, ordered)
    dataset = Dataset(
        folder=Path(),
        source=arm.source,
        control=arm.plant.control,
        joints=arm.plant.labels,
        actuators=POSE if arm.plant.control == "pose" else arm.plant.labels,
        trajectories=tuple(
            _trajectory(arm, part, each.reports) for part, each in zip(ordered, judged, strict=True)
        ),
        caveats=(),
        hash="",
    )
    return Programme(
        arm=arm,
        parts=tuple(ordered),
        predicted=dataset,
        effort=np.array([each.efforts for each in judged]),
        lead=np.array([each.lead for each in judged]),
    )
