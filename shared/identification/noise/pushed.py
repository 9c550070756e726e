"""How far random torques push an arm that a controller holds by its tool.

Nothing brings seven joints back along the motion that leaves the tool where it is, and little does
near a singular posture: whatever pushes the arm at random adds up there. Two recordings of the
same commands came to differ by 40 mrad along such a motion, by 0.3 mrad across it. So a residual
of the joints counts in units of a covariance,

    C = reading^2 I + push^2 S S',  S = (J'K J + M / time^2 + D / time)^-1 T,

with the tool's Jacobian J, the servo's gains K, inertia M and damping D of the joints, and the
largest torque of each on the diagonal of T: the answer to random torques that lasts for a time.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from shared.identification.dataset.types import Float64
from shared.sim.plant.kinematics import tool_motion
from shared.sim.plant.rollouts import Rollouts

_TIMES = (0.05, 0.1, 0.2, 0.4, 0.8)
"""Tried (s)."""
_PUSHES = tuple(np.geomspace(1e-4, 0.1, 25).tolist())
"""Shares of the largest torques, tried."""
_LEAST_READING = 1e-7
"""(rad)."""


@dataclass(frozen=True)
class Pushed:
    """Random torques, and noise of readings, as repeats show them."""

    reading: float
    """Standard deviation of a block mean of readings (rad)."""
    push: float
    """Of random torques, as a share of each joint's largest."""
    time: float
    """For which they push one way (s)."""

    def torque(self, nominal: Rollouts, joint: str) -> float:
        """Return the standard deviation of what pushes a logged joint at random (N m)."""
        model, plant = nominal.model, nominal.plant
        return self.push * float(model.jnt_actfrcrange[model.joint(plant.mj_joint(joint)).id, 1])


def whitening(pushed: Pushed, nominal: Rollouts, q: Float64) -> Float64:
    """Return float64[B, J, J], what makes residuals at postures float64[B, J] of unit variance."""
    spread, turned = np.linalg.eigh(_covariance(pushed, _soft(nominal, q, pushed.time)))
    return np.asarray(np.einsum("bik,bk,bjk->bij", turned, spread**-0.5, turned), np.float64)


def pushed_of(
    nominal: Rollouts, differences: Sequence[tuple[Float64, Float64]], scale: float
) -> Pushed | None:
    """Return what makes differences of repeats likeliest; None for an arm held by its joints.

    Args:
        nominal: the arm.
        differences: what repeats differ by and where they were, block means: float64[B, J] twice.
        scale: turns a difference into noise: root 0.5 where both recordings have it.
    """
    if nominal.plant.control != "pose" or not differences:
        return None
    off = scale * np.concatenate([each for each, _ in differences])
    q = np.concatenate([each for _, each in differences])
    likeliest = min(
        (
            (*_unlikeliness(off, _soft(nominal, q, time), push), push, time)
            for time in _TIMES
            for push in _PUSHES
        ),
    )
    _, reading, push, time = likeliest
    return Pushed(reading, push, time)


def _soft(nominal: Rollouts, q: Float64, time: float) -> Float64:
    """Return float64[B, J, J], S of the module's formula (rad)."""
    model, plant = nominal.model, nominal.plant
    _, jacobian = tool_motion(plant, model, q)
    gains = [float(model.actuator(name).gainprm[0]) for name in plant.actuators]
    stiffness = np.array([*gains[:3], *gains[3:] * 3])
    dofs = [int(model.joint(name).dofadr[0]) for name in plant.joints]
    joints = [int(model.joint(name).id) for name in plant.joints]
    held = np.diag(model.dof_M0[dofs] / time**2 + model.dof_damping[dofs] / time)
    largest = np.diag(model.jnt_actfrcrange[joints, 1])
    stiff = np.einsum("bij,i,bik->bjk", jacobian, stiffness, jacobian)
    return np.asarray(np.linalg.solve(stiff + held, largest), np.float64)


def _covariance(pushed: Pushed, soft: Float64) -> Float64:
    of_pushes = pushed.push**2 * soft @ soft.transpose(0, 2, 1)
    return np.asarray(pushed.reading**2 * np.eye(soft.shape[1]) + of_pushes, np.float64)


def _unlikeliness(off: Float64, soft: Float64, push: float) -> tuple[float, float]:
    """Return minus the log likelihood of the best noise of readings beside pushes, and that noise.

    Directions are taken one by one: those along which pushes show least say most of readings.
    """
    spread, turned = np.linalg.eigh(soft @ soft.transpose(0, 2, 1))
    power = np.einsum("bij,bi->bj", turned, off) ** 2
    of_pushes = push**2 * np.maximum(spread, 0.0)
    reading = float(np.median(power[:, 0]) / 0.455)
    for _ in range(20):  # a scoring iteration: weights by how much of a direction readings make
        weight = (reading / (reading + of_pushes)) ** 2
        reading = float(np.sum(weight * (power - of_pushes)) / np.sum(weight))
        reading = max(reading, _LEAST_READING**2)
    variance = reading + of_pushes
    return float(np.sum(np.log(variance) + power / variance)), float(np.sqrt(reading))
