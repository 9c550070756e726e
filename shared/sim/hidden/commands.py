"""What an arm is told, to go through postures."""

import numpy as np

from shared.sim.arm import Float64
from shared.sim.hidden.arms import HiddenArm
from shared.sim.plant.inverse import inverse_dynamics
from shared.sim.plant.kinematics import tool_poses


def commands_for(arm: HiddenArm, at: Float64, q: Float64) -> Float64:
    """Return float64[C, U]: poses, positions, or the torques that the model needs.

    Args:
        arm: which.
        at: float64[C] (s), evenly spaced.
        q: float64[C, J], postures (rad).
    """
    if arm.control == "position":
        return q
    plant = arm.make()
    model = plant.make().compile()
    if arm.control == "pose":
        poses = tool_poses(plant, model, q)
        flips = np.einsum("ij,ij->i", poses[1:, 3:], poses[:-1, 3:]) < 0.0
        poses[1:, 3:] *= np.where(np.cumsum(flips) % 2 == 1, -1.0, 1.0)[:, None]
        return poses
    qd = np.gradient(q, at, axis=0)
    torques = inverse_dynamics(plant, model, q, qd, np.gradient(qd, at, axis=0))
    return np.clip(torques, -arm.torque, arm.torque)
