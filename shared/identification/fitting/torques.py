"""A start for fits of an arm that is driven by torques: what its motion takes, and what it got.

The torques that a motion takes are linear in most of what is fitted (Atkeson, An and Hollerbach
1986), so they lead near the best fit from any model file. Following the arm in time does not: an
arm too heavy to be moved by anything goes on as it was measured to begin, and is a minimum, too.
"""

import numpy as np
from numpy.typing import NDArray

from shared.identification.arm.known_efforts import known_effort_of
from shared.identification.arm.motion import Motion, motion_of, smooth_motion
from shared.identification.dataset.types import Float64, Trajectory
from shared.identification.fitting.linear import bounded
from shared.identification.fitting.parameters import LOOSE
from shared.identification.fitting.space import Space
from shared.sim.plant.inverse import inverse_dynamics, model_of

_INSTANTS = 500
"""At which torques are compared, of all recordings together."""
_EXACT = 0.1
"""Of what drives a joint: how well its torque is known at an instant."""
_STEPS = 6
"""Derivatives: what friction holds, and products of a mass and its place, are not linear."""
_STEP = 0.02
"""Of a difference quotient: 2 %."""


def by_torques(space: Space) -> Float64:
    """Return the vector by which the motion that was fitted to takes the torques that it got.

    Args:
        space: of an arm under torque control; its candidates change fields of the model alone.
    """
    subject = space.problem.subject
    recordings = [
        each
        for each in space.problem.dataset.trajectories
        if each.split == "train" and not each.repeats
    ]
    every = max(sum(len(each.joints_at) for each in recordings) // _INSTANTS, 1)
    parts = [_part(space, each, every) for each in recordings]
    nominal, first = subject.nominal, space.problem.segments[0].recorded
    exact = _EXACT * np.maximum(subject.drive, 1e-9)
    free = _free(space)
    priors = np.where(free, np.inf, space.priors)

    def residual(u: Float64) -> Float64:
        variant = space.variant(_vector(u, free))
        model = model_of(nominal.entered(space.problem.entry(variant), first))
        missing = [
            inverse_dynamics(subject.plant, model, motion.q, motion.qd, motion.qdd) - torque
            for motion, torque in parts
        ]
        return np.r_[(np.concatenate(missing) / exact).ravel(), u / priors]

    low, high = space.bounds
    low = np.where(free, np.expm1(low), low)
    high = np.where(free, np.expm1(high), high)
    u = space.details
    for _ in range(_STEPS):
        here = residual(u)
        steps = np.where(free, _STEP * (1.0 + u), space.steps)
        columns = [(residual(u + step) - here) / step.sum() for step in np.diag(steps)]
        u = np.clip(u + bounded(np.stack(columns, axis=1), -here, low - u, high - u), low, high)
    return space.clip(_vector(u, free))


def _free(space: Space) -> NDArray[np.bool_]:
    """Return bool[n], which numbers are factors of which little is known.

    Torques are linear in such a number, not in its logarithm.
    """
    found = [each.is_factor and each.prior == LOOSE for each in space.problem.parameters]
    return np.array(found + [False] * (space.size - len(found)))


def _vector(u: Float64, free: NDArray[np.bool_]) -> Float64:
    """Return a space's vector, of free factors less 1 and the other numbers as they are."""
    z = u.copy()
    z[free] = np.log1p(u[free])
    return z


def _part(space: Space, of: Trajectory, every: int) -> tuple[Motion, Float64]:
    """Return the motion of a recording and float64[T, J], the torques that it got, alike smooth."""
    torque = known_effort_of(space.problem.subject.nominal, of, of.joints_at)
    assert torque is not None  # commands are torques
    smooth = smooth_motion(of.joints_at, torque)
    return motion_of(of).sparse(every), smooth.q[::every]
