"""How joints that no encoder sees swing when a part of a recording begins.

A part begins at the measured state, but what the arm stands on, or a link behind a gear that gives,
is not measured. It is known what the arm did until then, so what that took of such joints (load l
and inertia M) is, too:

    M x'' + C x' + K x = -l,

at rest when the recording began; integrated by the trapezoidal rule. Where encoders see the link
it is its motion that is known, and the motor's that is not: C x' + K x = -l of what is seen.
"""

import functools
from collections.abc import Sequence
from dataclasses import dataclass
from weakref import WeakKeyDictionary

import numpy as np

from shared.identification.arm.motion import Motion, smooth_motion
from shared.identification.dataset.types import Float64
from shared.sim.plant.inverse import held_still
from shared.sim.plant.row import Row
from shared.sim.plant.signals import Signal, sampled

_AFTER = 0.2
"""Of the log after the part begins, for speeds until then (s)."""
_WIDE = 0.12
"""Of what accelerations of a seen link are taken from, by polynomials of degree 4 (s)."""
_APART = 0.02
"""Either side of time 0, of loads that say how fast they grow (s)."""
_KEPT = 512
"""States that are kept: of a derivative, most columns leave what gives as it is."""
_FEWEST = 20
"""Readings that a motion can be told from."""


@dataclass(frozen=True, eq=False)
class _Before:
    """What the arm did before time 0, as such joints feel it."""

    at: Float64
    """float64[T] (s)."""
    load: Float64
    """float64[T, B], what holds them still (N m)."""
    inertia: Float64
    """float64[T, B, B], of what they carry (kg m^2)."""


_Told = dict[tuple[tuple[str, ...], float, int], _Before | None]
_known: WeakKeyDictionary[Signal, _Told] = WeakKeyDictionary()
"""Of a recording's log, by joints and by what speeds are taken from."""


def start_swaying(row: Row, names: Sequence[str], width: float) -> None:
    """Let added joints that have their springs begin as the arm's motion before time 0 left them.

    Args:
        row: a part of a recording; one that begins where the recording does starts at rest.
        names: in the MJCF.
        width: of what the arm's speeds are taken from (s), see :func:`smooth_motion`; as short as
            what gives may swing in.
    """
    if row.begin <= 0.0:
        return
    before = _before(row, names, width, 3)
    if before is None:
        return
    joints = [row.mj_joint(name) for name in names]
    dofs = [int(row.model.jnt_dofadr[joint]) for joint in joints]
    stiffness = row.field("jnt_stiffness")[joints]
    armature = row.field("dof_armature")[dofs]
    damping = row.field("dof_damping")[dofs]
    state = _swung(before, tuple(stiffness), tuple(damping), tuple(armature))
    for name, place, speed in zip(names, *np.split(state, 2), strict=True):
        row.start(name, float(place), float(speed))


def start_stretched(row: Row, name: str) -> None:
    """Let the spring before a link that the encoder sees begin as what the link takes bends it.

    Args:
        row: a part of a recording; one that begins where the recording does starts at rest.
        name: of the spring's joint in the MJCF.
    """
    if row.begin <= 0.0:
        return
    before = _before(row, (name,), _WIDE, 4)
    if before is None:
        return
    joint = row.mj_joint(name)
    stiffness = row.field("jnt_stiffness")[joint]
    damping = row.field("dof_damping")[row.model.jnt_dofadr[joint]]
    loads = sampled(before.at, before.load, np.array([-_APART, 0.0, _APART]))[:, 0]
    speed = -float((loads[2] - loads[0]) / (2.0 * _APART * stiffness))
    row.start(name, float(-(loads[1] + damping * speed) / stiffness), speed)


@functools.lru_cache(_KEPT)
def _swung(
    before: _Before,
    stiffness: tuple[float, ...],
    damping: tuple[float, ...],
    armature: tuple[float, ...],
) -> Float64:
    """Return float64[2 B], positions and then speeds at time 0 (rad, rad/s)."""
    count = len(stiffness)
    inverse = np.linalg.inv(before.inertia + np.diag(armature))
    flow = np.zeros((len(before.at), 2 * count, 2 * count))
    flow[:, :count, count:] = np.eye(count)
    flow[:, count:, :count] = -inverse * np.array(stiffness)
    flow[:, count:, count:] = -inverse * np.array(damping)
    pushed = np.zeros((len(before.at), 2 * count))
    pushed[:, count:] = -np.einsum("tij,tj->ti", inverse, before.load)
    half = 0.5 * float(before.at[1] - before.at[0])
    same = np.eye(2 * count)
    implicit = np.linalg.inv(same - half * flow[1:])
    ways = implicit @ (same + half * flow[:-1])
    steps = np.einsum("tij,tj->ti", implicit, half * (pushed[1:] + pushed[:-1]))
    states = np.empty((len(before.at), 2 * count))
    states[0] = np.r_[-before.load[0] / np.array(stiffness), np.zeros(count)]
    for index, (way, step) in enumerate(zip(ways, steps, strict=True)):
        states[index + 1] = way @ states[index] + step
    return sampled(before.at, states, np.zeros(1))[0]


def _before(row: Row, names: Sequence[str], width: float, degree: int) -> _Before | None:
    """Return what the arm did before time 0; None if that is too short to tell; worked out once."""
    log, key = row.logged_q, (tuple(names), width, degree)
    known = _known.setdefault(log, {})
    if key not in known:
        done = None
        if (log.at < 0.0).sum() >= _FEWEST:
            motion = _from_rest(log, width, degree)
            load, inertia = held_still(row.plant, row.model, names, motion.q, motion.qd, motion.qdd)
            done = _Before(motion.at, load, inertia)
        known[key] = done
    return known[key]


def _from_rest(log: Signal, width: float, degree: int) -> Motion:
    """Return a recording's motion up to time 0, from a moment before, in which the arm is at rest.

    It may begin with a jerk, which a speed from readings on both sides would leave out.
    """
    is_seen = log.at < _AFTER
    at, q = log.at[is_seen], log.values[is_seen]
    before: Float64 = at[0] - np.arange(width, 0.0, -float(np.median(np.diff(at))))
    still = np.tile(q[0], (len(before), 1))
    return smooth_motion(np.concatenate([before, at]), np.concatenate([still, q]), width, degree)
