"""How joints that no encoder sees swing when a part of a recording begins.

A part begins at the measured state, but what the arm stands on is not measured. It is known what
the arm did until then, so what that took of the joints under it (load l and inertia M) is, too:

    M x'' + C x' + K x = -l,

at rest when the recording began; integrated by the trapezoidal rule.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from weakref import WeakKeyDictionary

import numpy as np

from shared.identification.arm.motion import smooth_motion
from shared.identification.dataset.types import Float64
from shared.sim.plant.inverse import held_still
from shared.sim.plant.row import Row
from shared.sim.plant.signals import Signal, sampled

_AFTER = 0.2
"""Of the log after the part begins, for speeds until then (s)."""
_FEWEST = 20
"""Readings that a motion can be told from."""


@dataclass(frozen=True)
class _Before:
    """What the arm did before time 0, as joints under it feel it."""

    at: Float64
    """float64[T] (s)."""
    load: Float64
    """float64[T, B], what holds them still (N m)."""
    inertia: Float64
    """float64[T, B, B] (kg m^2)."""


_known: WeakKeyDictionary[Signal, _Before | None] = WeakKeyDictionary()


def start_swaying(row: Row, names: Sequence[str]) -> None:
    """Let added joints that have their springs begin as the arm's motion before time 0 left them.

    Args:
        row: a part of a recording; one that begins where the recording does starts at rest.
        names: in the MJCF, always the same ones in the same order.
    """
    if row.begin <= 0.0:
        return
    before = _before(row, names)
    if before is None:
        return
    joints = [row.mj_joint(name) for name in names]
    dofs = [int(row.model.jnt_dofadr[joint]) for joint in joints]
    stiffness = row.field("jnt_stiffness")[joints]
    more = row.field("dof_armature")[dofs] - row.model.dof_armature[dofs]
    state = _swung(before, stiffness, row.field("dof_damping")[dofs], np.diag(more))
    for name, place, speed in zip(names, *np.split(state, 2), strict=True):
        row.start(name, float(place), float(speed))


def _swung(before: _Before, stiffness: Float64, damping: Float64, more: Float64) -> Float64:
    """Return float64[2 B], positions and then speeds at time 0 (rad, rad/s)."""
    count = len(stiffness)
    inverse = np.linalg.inv(before.inertia + more)
    flow = np.zeros((len(before.at), 2 * count, 2 * count))
    flow[:, :count, count:] = np.eye(count)
    flow[:, count:, :count] = -inverse * stiffness
    flow[:, count:, count:] = -inverse * damping
    pushed = np.zeros((len(before.at), 2 * count))
    pushed[:, count:] = -np.einsum("tij,tj->ti", inverse, before.load)
    half = 0.5 * float(before.at[1] - before.at[0])
    same = np.eye(2 * count)
    implicit = np.linalg.inv(same - half * flow[1:])
    ways = implicit @ (same + half * flow[:-1])
    steps = np.einsum("tij,tj->ti", implicit, half * (pushed[1:] + pushed[:-1]))
    states = np.empty((len(before.at), 2 * count))
    states[0] = np.r_[-before.load[0] / stiffness, np.zeros(count)]
    for index, (way, step) in enumerate(zip(ways, steps, strict=True)):
        states[index + 1] = way @ states[index] + step
    return sampled(before.at, states, np.zeros(1))[0]


def _before(row: Row, names: Sequence[str]) -> _Before | None:
    """Return what the arm did before time 0; None if that is too short to tell; worked out once."""
    if row.logged_q not in _known:
        log = row.logged_q
        done = None
        if (log.at < 0.0).sum() >= _FEWEST:
            is_seen = log.at < _AFTER
            motion = smooth_motion(log.at[is_seen], log.values[is_seen])
            if motion.at[0] < 0.0:
                load, inertia = held_still(
                    row.plant, row.model, names, motion.q, motion.qd, motion.qdd
                )
                done = _Before(motion.at, load, inertia)
        _known[log] = done
    return _known[row.logged_q]
