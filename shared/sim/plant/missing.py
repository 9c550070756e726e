"""Torques that a measured motion takes beyond what the model's drives give there."""

import copy

import mujoco
import numpy as np

from shared.sim.arm import Float64
from shared.sim.plant.row import Row


def missing_torque(row: Row, at: Float64, q: Float64, qd: Float64, qdd: Float64) -> Float64:
    """Return float64[T, J]: what else must have acted on the logged joints (N m, N).

    Inverse dynamics of the motion less what the actuators do at the measured state under the
    command that was in force. Added joints and torque laws of the row are left out.

    Args:
        row: the arm, of a batch without added joints, with its base parameters entered.
        at: float64[T], instants (s).
        q: float64[T, J] (rad, m).
        qd: float64[T, J] (rad/s, m/s).
        qdd: float64[T, J] (rad/s^2, m/s^2).
    """
    model = copy.copy(row.model)
    for name, values in row.fields.items():
        owner = model.opt if name.startswith("opt.") else model
        field = getattr(owner, name.removeprefix("opt."))
        field[...] = values.reshape(np.shape(field))
    data = mujoco.MjData(model)
    joints = [model.joint(name) for name in row.plant.joints]
    places = np.array([int(joint.qposadr[0]) for joint in joints])
    dofs = np.array([int(joint.dofadr[0]) for joint in joints])
    columns = np.concatenate([_controls(model, name) for name in row.plant.actuators])
    commands = row.command.held(at)
    out = np.empty_like(q)
    for index in range(len(at)):
        data.qpos[places], data.qvel[dofs] = q[index], qd[index]
        data.ctrl[columns] = commands[index]
        mujoco.mj_fwdPosition(model, data)
        mujoco.mj_fwdVelocity(model, data)
        mujoco.mj_fwdActuation(model, data)
        driven = data.qfrc_actuator[dofs].copy()
        data.qacc[dofs] = qdd[index]
        mujoco.mj_inverse(model, data)
        out[index] = data.qfrc_inverse[dofs] - driven
    return out


def _controls(model: mujoco.MjModel, name: str) -> np.ndarray:
    """Return which of the model's controls are an actuator's."""
    actuator = int(model.actuator(name).id)
    first = int(model.actuator_ctrladr[actuator])
    return np.arange(first, first + int(model.actuator_ctrlnum[actuator]))
