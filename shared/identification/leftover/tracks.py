"""What a model leaves of each recording, in noise floors, on either side of the encoders."""

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from shared.identification.arm.efforts import effort_of
from shared.identification.arm.motion import motion_of
from shared.identification.arm.parts import CUT, CUTS, Cut, width_of
from shared.identification.arm.smoothing import smooth
from shared.identification.dataset.types import Float64, Trajectory
from shared.identification.fitting.parameters import enter_base
from shared.identification.fitting.problem import BLOCK, DIVERGED, Problem, Variant
from shared.identification.noise.blocks import block_means
from shared.identification.noise.drift import Drift
from shared.sim.plant.inverse import inverse_dynamics
from shared.sim.plant.kinematics import tool_poses
from shared.sim.plant.missing import missing_torque
from shared.sim.plant.replay import Reports
from shared.sim.plant.row import Row
from shared.sim.plant.signals import pose_error, sampled


@dataclass(frozen=True)
class Track:
    """Blocks of a recording, seen by the encoders or by what is behind them."""

    trajectory: int
    at: Float64
    """float64[B], middles (s)."""
    x: Float64
    """float64[B, C], residuals in noise floors; C joints, or six errors of the tool's pose."""
    q: Float64
    """float64[B, J] (rad, m)."""
    qd: Float64
    """float64[B, J] (rad/s, m/s)."""
    effort: Float64
    """float64[B, J], what drives the joints (N m, N)."""
    load: Float64
    """float64[B, J], what of it reaches the links (N m, N)."""
    predicted: Float64 | None
    """float64[T, J] at the readings of the joints (rad, m); None if replayed in parts."""


def tracks_of(
    problem: Problem, variant: Variant, segments: Sequence[int]
) -> tuple[list[Track], list[Track]]:
    """Return what joints and what trackers show that a model does not explain.

    Of the tracker only what is behind the encoders: its residual, less what forward kinematics of
    measured and predicted joints differ by, so that a joint's error does not count twice.

    Args:
        problem: data set and arm.
        variant: the model.
        segments: what to look at.
    """
    found = problem.reports([variant], segments)[0]
    parts: dict[int, list[tuple[int, Reports]]] = defaultdict(list)
    for segment, reports in zip(segments, found, strict=True):
        parts[problem.segments[segment].trajectory].append((segment, reports))
    joints: list[Track] = []
    trackers: list[Track] = []
    for trajectory, pieces in parts.items():
        of = problem.dataset.trajectories[trajectory]
        seen = [_joints(problem, segment, reports) for segment, reports in pieces]
        whole = pieces[0][1].q if len(pieces) == 1 else None
        if whole is not None and len(whole) < len(of.q):
            whole = None
        joints.append(_track(problem, trajectory, of, seen, whole))
        seen = [
            piece
            for segment, reports in pieces
            if (piece := _behind(problem, of, segment, reports)) is not None
        ]
        if seen:
            trackers.append(_track(problem, trajectory, of, seen, None))
    return joints, trackers


def missing_of(problem: Problem, variant: Variant, track: Track) -> Float64:
    """Return float64[B, J]: joint torques that a recording takes beyond the model's (N m, N).

    That of the predicted motion is taken off, with it what the variant's effects account for and
    what smoothing bends.
    """
    of = problem.dataset.trajectories[track.trajectory]
    begun = next(each.recorded for each in problem.segments if each.trajectory == track.trajectory)
    row = problem.subject.nominal.entered(
        lambda row: enter_base(problem.parameters, variant.x, row), begun
    )
    out = _missing(row, of, begun.begin, track.at)
    if track.predicted is not None and np.isfinite(track.predicted).all():
        out -= _missing(row, replace(of, q=track.predicted), begun.begin, track.at)
    return out


def _missing(row: Row, of: Trajectory, begin: float, wanted: Float64) -> Float64:
    motion = motion_of(of)
    every = max(round(BLOCK / float(np.median(np.diff(motion.at)))), 1)
    motion = motion.sparse(every)
    torque = missing_torque(row, motion.at - begin, motion.q, motion.qd, motion.qdd)
    return sampled(motion.at, torque, wanted)


def _track(
    problem: Problem,
    trajectory: int,
    of: Trajectory,
    seen: list[tuple[Float64, Float64]],
    predicted: Float64 | None,
) -> Track:
    at = np.concatenate([each[0] for each in seen])
    motion = motion_of(of)
    q, qd, qdd = (sampled(motion.at, each, at) for each in (motion.q, motion.qd, motion.qdd))
    subject = problem.subject
    load = inverse_dynamics(subject.plant, subject.nominal.model, q, qd, qdd, is_of_links=True)
    return Track(
        trajectory=trajectory,
        at=at,
        x=np.nan_to_num(
            np.concatenate([each[1] for each in seen]),
            nan=DIVERGED,
            posinf=DIVERGED,
            neginf=-DIVERGED,
        ),
        q=q,
        qd=qd,
        effort=effort_of(subject, of, at),
        load=load,
        predicted=predicted,
    )


def _joints(problem: Problem, segment: int, reports: Reports) -> tuple[Float64, Float64]:
    """Return instants and joint residuals of a segment's blocks."""
    recorded = problem.segments[segment].recorded
    at = recorded.joints_at - recorded.joints_at[0]
    middles = block_means(at, recorded.joints_at[:, None], BLOCK)[:, 0]
    if problem.noise.has_free_starts:
        x = problem.floors(reports, segment)[:, : len(problem.noise.joints)]
    else:
        off = block_means(at, problem.segments[segment].q - reports.q, BLOCK)
        x = problem.in_floors(off, segment)
    if isinstance(problem.noise.memory, Drift):
        x = x / problem.noise.memory.spread(len(x))[:, : x.shape[1]]
    elif recorded.begin > 0.0 and not problem.noise.has_free_starts:
        spread = _spread(at, middles, CUTS.get(problem.subject.control, CUT))
        if not problem.noise.is_measured:  # then the floor is what parts leave, spread and all
            spread /= np.median(spread)
        x = x / spread[:, None]
    return recorded.begin + middles[: len(x)], x


def _spread(at: Float64, middles: Float64, cut: Cut) -> Float64:
    """Return float64[B]: how the noise of a measured start spreads as a part goes on (1).

    The start's velocity is a local cubic's, and white noise of readings makes it wrong.
    """
    period = float(np.median(np.diff(at))) if len(at) > 1 else BLOCK
    width = width_of(period, cut)
    unit = np.eye(width)[:, width // 2 : width // 2 + 1]
    readings = max(BLOCK / period, 1.0)
    of_rate = float(np.linalg.norm(smooth(unit, width, period))) * np.sqrt(readings)
    return np.minimum(np.sqrt(1.0 + (of_rate * middles) ** 2), cut.spread)


def _behind(
    problem: Problem, of: Trajectory, segment: int, reports: Reports
) -> tuple[Float64, Float64] | None:
    """Return instants and what is behind the encoders in a segment's blocks."""
    recorded, logged = problem.segments[segment].recorded, problem.segments[segment].tracker
    at, noise = recorded.tracker_at, problem.noise.tracker
    if at is None or logged is None or reports.tracker is None or noise is None:
        return None
    plant, model = problem.subject.plant, problem.subject.nominal.model
    measured = tool_poses(plant, model, sampled(of.joints_at - recorded.begin, of.q, at))
    predicted = tool_poses(plant, model, sampled(recorded.joints_at, reports.q, at))
    off = pose_error(logged, reports.tracker) - pose_error(measured, predicted)
    middles = block_means(at - at[0], at[:, None], BLOCK)[:, 0]
    return recorded.begin + middles, block_means(at - at[0], off, BLOCK) / noise
