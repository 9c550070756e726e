"""A joint whose link does not stand where its motor does: what elasticity and backlash share.

The logged joint is the motor's side. A second joint carries the link, and the torque between them
is the load: what the link takes of gravity and inertia.
"""

import functools
from collections.abc import Callable

import numpy as np

from shared.identification.dataset.types import Float64
from shared.identification.smoothing import smooth
from shared.identification.subject import Subject
from shared.sim.plant.inverse import inverse_dynamics
from shared.sim.plant.kinematics import tool_motion
from shared.sim.plant.plant import Model, Plant
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
_KEPT = 512
"""Recordings, or parts of them, of which loads and turns are kept."""
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
    logged, joint, found = row.logged_q, row.plant.labels.index(label), off()
    links = _links(logged, row.duration, joint, found.at.tobytes(), found.values.tobytes())
    row.on_target(lambda target: as_if_at(row, target, logged, links))


@functools.lru_cache(_KEPT)
def _links(log: Signal, until: float, joint: int, at: bytes, off: bytes) -> Signal:
    """Return where the links are: the same object for the same ones, whose kinematics are kept."""
    links = _near(log, until)
    turned = np.interp(links.at, np.frombuffer(at), np.frombuffer(off))
    links.values[:, joint] += turned
    return links


def bent_by_load(row: Row, label: str, bent: Callable[[Float64], Float64]) -> Signal:
    """Return how far a link is off its motor, with the load that the logged motion takes.

    Args:
        row: the arm.
        label: the logged joint.
        bent: turns loads float64[T] (N m, N) into float64[T] (rad, m).
    """
    at, load = _load(row.plant, row.model, row.logged_q, row.duration)
    return Signal(at, bent(load[:, row.plant.labels.index(label)])[:, None])


@functools.lru_cache(_KEPT)
def _load(plant: Plant, model: Model, log: Signal, until: float) -> tuple[Float64, Float64]:
    """Return instants, and the load of every link there: float64[T, J] (N m, N)."""
    logged = _near(log, until)
    at: Float64 = np.arange(float(logged.at[0]), float(logged.at[-1]), _PERIOD, dtype=np.float64)
    # A local mean takes the encoders' noise off before it is differentiated twice.
    near = np.linspace(-1.0, 1.0, 9) * _PERIOD
    q = np.mean([sampled(logged.at, logged.values, at + shift) for shift in near], axis=0)
    qd = np.gradient(q, _PERIOD, axis=0)
    qdd = np.gradient(qd, _PERIOD, axis=0)
    return at, inverse_dynamics(plant, model, q, qd, qdd, is_of_links=True)


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
    joint = row.plant.labels.index(label)
    return _turn(row.plant, row.model, row.logged_q, row.logged_tracker, joint, row.duration)


@functools.lru_cache(_KEPT)
def _turn(
    plant: Plant, model: Model, log: Signal, tracker: Signal, joint: int, until: float
) -> Signal | None:
    """Return the turn of a joint that a tracker saw and its encoder did not, float64[T, 1]."""
    seen = _near(tracker, until)
    if len(seen.at) < _FEWEST:
        return None
    poses, jacobian = tool_motion(plant, model, sampled(log.at, log.values, seen.at))
    units = np.array([1.0, 1.0, 1.0, _LEVER, _LEVER, _LEVER])
    column = jacobian[:, :, joint] * units
    off = pose_error(seen.values, poses) * units
    turn = np.sum(column * off, axis=1) / np.maximum(np.sum(column**2, axis=1), 1e-9)
    return Signal(seen.at, smooth(turn[:, None], _SMOOTH))


def _near(log: Signal, until: float) -> Signal:
    """Return what was logged while something is replayed, and just before and after."""
    is_near = (log.at >= -_AROUND) & (log.at <= until + _AROUND)
    return Signal(log.at[is_near], log.values[is_near])
