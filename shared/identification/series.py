"""A joint whose link does not stand where its motor does: what elasticity and backlash share.

The logged joint is the motor's side. A second joint carries the link, and the torque between them
is the load: what the link takes of gravity and inertia.
"""

from collections.abc import Callable

import numpy as np

from shared.identification.dataset.types import Float64
from shared.identification.smoothing import smooth
from shared.identification.subject import Subject
from shared.sim.plant.inverse import inverse_dynamics
from shared.sim.plant.kinematics import tool_motion
from shared.sim.plant.row import Row
from shared.sim.plant.signals import Signal, pose_error, sampled
from shared.sim.plant.structure import JOINT_MOTORS, Builder, Edit, Structure
from shared.sim.plant.targets import as_if_at

_PERIOD = 0.02
"""Of the instants at which a recording's load is taken (s)."""
_AROUND = 0.2
"""Either side of what is replayed, of which the load is taken too (s)."""
_LEVER = 0.5
"""What a tracker's turn counts beside its way: a bat's length (m)."""
_SMOOTH = 11
"""Readings of a tracker that a turn is taken from; odd."""
_FEWEST = 20
"""Readings that it takes to say where a link was."""


def series(subject: Subject, label: str, part: str) -> Structure:
    """Return what puts a second joint behind a logged one."""

    def change(builder: Builder) -> None:
        builder.series_joint(label, part)

    joint = Edit(f"{part} {label}", change)
    return (joint, JOINT_MOTORS) if subject.control == "pose" else (joint,)


def link_inertia(row: Row, joint: int) -> float:
    """Return the inertia behind an added joint in the home posture (kg m^2, kg)."""
    dof = int(row.model.jnt_dofadr[joint])
    return float(row.model.dof_M0[dof] - row.model.dof_armature[dof])


def hide_from_controller(row: Row, label: str, off: Callable[[], Signal]) -> None:
    """Let a controller of poses not know that the link is off its motor.

    A pose controller takes the tool to be where the encoders say: its target is off by what the
    link is off from its motor.

    Args:
        row: the arm.
        label: the logged joint.
        off: returns how far it is off, float64[T, 1] (rad, m); asked of an arm under poses only.
    """
    if row.plant.control != "pose":
        return
    logged, found = row.logged_q, off()
    is_near = (logged.at >= -_AROUND) & (logged.at <= row.duration + _AROUND)
    at, true = logged.at[is_near], logged.values[is_near].copy()
    true[:, row.plant.labels.index(label)] += sampled(found.at, found.values, at)[:, 0]
    links = Signal(at, true)
    row.on_target(lambda target: as_if_at(row, target, logged, links))


def bent_by_load(row: Row, label: str, bent: Callable[[Float64], Float64]) -> Signal:
    """Return how far a link is off its motor, with the load that the logged motion takes.

    Args:
        row: the arm.
        label: the logged joint.
        bent: turns loads float64[T] (N m, N) into float64[T] (rad, m).
    """
    logged = _near(row, row.logged_q)
    at: Float64 = np.arange(float(logged.at[0]), float(logged.at[-1]), _PERIOD, dtype=np.float64)
    # A local mean takes the encoders' noise off before it is differentiated twice.
    near = np.linspace(-1.0, 1.0, 9) * _PERIOD
    q = np.mean([sampled(logged.at, logged.values, at + shift) for shift in near], axis=0)
    qd = np.gradient(q, _PERIOD, axis=0)
    qdd = np.gradient(qd, _PERIOD, axis=0)
    load = inverse_dynamics(row.plant, row.model, q, qd, qdd, is_of_links=True)
    return Signal(at, bent(load[:, row.plant.labels.index(label)])[:, None])


def seen_by_tracker(row: Row, label: str) -> Signal | None:
    """Return how far a link is off its motor as a tracker saw it; None without one.

    It is the turn of the joint that brings the tool from where the encoders have it to where it
    was seen, as well as a turn can (least squares).

    Args:
        row: the arm.
        label: the logged joint.
    """
    if row.logged_tracker is None:
        return None
    seen = _near(row, row.logged_tracker)
    if len(seen.at) < _FEWEST:
        return None
    q = sampled(row.logged_q.at, row.logged_q.values, seen.at)
    poses, jacobian = tool_motion(row.plant, row.model, q)
    units = np.array([1.0, 1.0, 1.0, _LEVER, _LEVER, _LEVER])
    column = jacobian[:, :, row.plant.labels.index(label)] * units
    off = pose_error(seen.values, poses) * units
    turn = np.sum(column * off, axis=1) / np.maximum(np.sum(column**2, axis=1), 1e-9)
    return Signal(seen.at, smooth(turn[:, None], _SMOOTH))


def _near(row: Row, log: Signal) -> Signal:
    """Return what was logged while something is replayed, and just before and after."""
    is_near = (log.at >= -_AROUND) & (log.at <= row.duration + _AROUND)
    return Signal(log.at[is_near], log.values[is_near])
