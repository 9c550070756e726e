"""A joint whose link does not stand where its motor does: what elasticity and backlash share.

The logged joint is the motor's side. A second joint carries the link, and the torque between them
is the load: what the link takes of gravity and inertia.
"""

import functools
from typing import NamedTuple

import numpy as np

from shared.identification.arm.subject import Subject
from shared.sim.plant.kinematics import tool_motion
from shared.sim.plant.plant import Model, Plant
from shared.sim.plant.row import Row
from shared.sim.plant.signals import Signal, pose_error, sampled
from shared.sim.plant.structure import Builder, Edit, Structure

_AROUND = 0.06
"""Either side of the start, in which a tracker is asked where a link was (s)."""
_LEVER = 0.5
"""What a tracker's turn counts beside its way: a bat's length (m)."""
_KEPT = 512
"""Recordings, or parts of them, of which it is kept where the link was."""
_FEWEST = 5
"""Readings that it takes to say so."""
_EITHER_SIDE = 4
"""Of these, before the start and after it, that it takes to say how it moves."""


def series(subject: Subject, label: str, part: str) -> Structure:
    """Return what puts a second joint behind a logged one."""

    def change(builder: Builder) -> None:
        builder.series_joint(label, part)

    return (Edit(f"{part} {label}", change),)


def link_inertia(row: Row, joint: int) -> float:
    """Return the inertia behind an added joint in the home posture (kg m^2, kg)."""
    dof = int(row.model.jnt_dofadr[joint])
    return float(row.model.dof_M0[dof] - row.model.dof_armature[dof])


class Seen(NamedTuple):
    """Where a link is beside its motor, as a tracker sees it."""

    place: float
    """(rad, m)."""
    speed: float
    """(rad/s, m/s)."""


def seen_by_tracker(row: Row, label: str) -> Seen | None:
    """Return where a link is beside its motor at the start, as a tracker saw it; None without one.

    It is the turn of the joint that brings the tool from where the encoders have it to where it
    was seen, as well as a turn can (least squares), and by how much it changes.

    Args:
        row: the arm; what begins with its recording begins at rest.
        label: the logged joint.
    """
    if row.logged_tracker is None:
        return None
    joint = row.plant.labels.index(label)
    return _turn(row.plant, row.model, row.logged_q, row.logged_tracker, joint)


@functools.lru_cache(_KEPT)
def _turn(plant: Plant, model: Model, log: Signal, tracker: Signal, joint: int) -> Seen | None:
    """Return the turn of a joint that a tracker saw and its encoder did not."""
    is_near = np.abs(tracker.at) <= _AROUND
    if np.count_nonzero(is_near) < _FEWEST:
        return None
    at = tracker.at[is_near]
    poses, jacobian = tool_motion(plant, model, sampled(log.at, log.values, at))
    units = np.array([1.0, 1.0, 1.0, _LEVER, _LEVER, _LEVER])
    column = jacobian[:, :, joint] * units
    off = pose_error(tracker.values[is_near], poses) * units
    earlier = np.count_nonzero(at < 0.0)
    is_moving = min(earlier, len(at) - earlier) >= _EITHER_SIDE
    powers = np.stack([np.ones_like(at), at] if is_moving else [np.ones_like(at)])
    moved = column * powers[:, :, None]
    found = np.linalg.lstsq(moved.reshape(len(powers), -1).T, off.ravel(), rcond=None)[0]
    return Seen(float(found[0]), float(found[1]) if is_moving else 0.0)
