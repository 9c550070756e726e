"""What an arm is to replay, how it moved, and what it would have logged of that."""

from dataclasses import dataclass

import numpy as np

from shared.sim.arm import Float64
from shared.sim.plant.kinematics import tool_poses
from shared.sim.plant.row import JointsReport, Row, TrackerReport
from shared.sim.plant.signals import Signal, sampled, sampled_poses


@dataclass(frozen=True)
class Recorded:
    """What an arm is to replay, and when it is to report."""

    initial_q: Float64
    """float64[J]."""
    initial_qd: Float64
    """float64[J]."""
    command: Signal
    logged_q: Signal
    joints_at: Float64
    """float64[T] (s)."""
    tracker_at: Float64 | None
    """float64[K] on the tracker's clock (s)."""
    trajectory: str = ""
    """Name of the recording that it is, or is a part of."""
    begin: float = 0.0
    """How far into the recording time 0 is (s)."""
    earlier: tuple[str, ...] = ()
    """Names of the recordings made before it."""
    logged_tracker: Signal | None = None
    """float64[C, 7] poses, of the whole recording."""


@dataclass(frozen=True)
class Reports:
    """What one arm would have logged."""

    q: Float64
    """float64[T, J]; NaN from where the physics diverged."""
    tracker: Float64 | None
    """float64[K, 7]."""


@dataclass(frozen=True)
class Motion:
    """How one arm moved."""

    times: Float64
    """float64[S + 1], ends of steps and their begin (s)."""
    q: Float64
    """float64[S + 1, J]."""
    tool: Float64 | None
    """float64[S, 7], before each step."""
    is_bad: bool
    """Whether the physics diverged."""


def reports_of(row: Row, recorded: Recorded, motion: Motion) -> Reports:
    """Return what an arm with effects in it logs of a motion.

    Args:
        row: the arm.
        recorded: what it replayed.
        motion: what it did.
    """
    q = sampled(motion.times, motion.q, recorded.joints_at)
    joints = JointsReport(recorded.joints_at, q)
    for change in row.joints_reports:
        change(joints)
    if motion.is_bad:
        joints.q = np.full_like(joints.q, np.nan)
    if recorded.tracker_at is None or motion.tool is None:
        return Reports(joints.q, None)
    at = recorded.tracker_at
    at = at if row.tracker_time is None else row.tracker_time(at)
    seen = _seen(row, motion.times[:-1], motion.tool, at)
    report = TrackerReport(recorded.tracker_at, seen)
    for change in row.tracker_reports:
        change(report)
    if motion.is_bad:
        report.pose = np.full_like(report.pose, np.nan)
    return Reports(joints.q, report.pose)


def _seen(row: Row, times: Float64, tool: Float64, at: Float64) -> Float64:
    """Return float64[K, 7]; of instants that were not replayed, from the joints' log."""
    poses = sampled_poses(times, tool, at)
    log = row.logged_q
    is_left = ((at < times[0]) | (at > times[-1])) & (at >= log.at[0]) & (at <= log.at[-1])
    if is_left.any():
        q = sampled(log.at, log.values, at[is_left])
        poses[is_left] = tool_poses(row.plant, row.model, q)
    return poses
