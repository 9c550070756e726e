"""Torques that a recorded motion takes of the arm as the model has it."""

import copy
from collections.abc import Iterator, Sequence

import mujoco
import numpy as np

from shared.sim.arm import Float64
from shared.sim.plant.plant import Plant
from shared.sim.plant.row import Row


def model_of(row: Row) -> mujoco.MjModel:
    """Return a model of its own for an arm, with the fields that it has changed."""
    model = copy.copy(row.model)
    for name, values in row.fields.items():
        owner = model.opt if name.startswith("opt.") else model
        field = getattr(owner, name.removeprefix("opt."))
        field[:] = values.reshape(field.shape)
    mujoco.mj_setConst(model, mujoco.MjData(model))
    return model


def inverse_dynamics(
    plant: Plant,
    model: mujoco.MjModel,
    q: Float64,
    qd: Float64,
    qdd: Float64,
    is_of_links: bool = False,
) -> Float64:
    """Return float64[T, J]: what the drives must put on the logged joints (N m, N).

    Joints that are not logged stand where the model has them.

    Args:
        plant: the arm.
        model: of it, compiled.
        q: float64[T, J] (rad, m).
        qd: float64[T, J] (rad/s, m/s).
        qdd: float64[T, J] (rad/s^2, m/s^2).
        is_of_links: leave out what armature, damping and friction take: what reaches the links.
    """
    if is_of_links:
        model = copy.copy(model)
        for field in (
            model.dof_armature, model.dof_damping, model.dof_dampingpoly, model.dof_frictionloss
        ):  # fmt: skip
            field[:] = 0.0
    dofs = np.array([int(model.joint(name).dofadr[0]) for name in plant.joints])
    out = np.empty_like(q)
    for index, data in enumerate(_inverted(plant, model, q, qd, qdd)):
        out[index] = data.qfrc_inverse[dofs]
    return out


def held_still(
    plant: Plant, model: mujoco.MjModel, names: Sequence[str], q: Float64, qd: Float64, qdd: Float64
) -> tuple[Float64, Float64]:
    """Return what a motion takes of joints that are not logged to hold them where they are.

    Args:
        plant: the arm.
        model: of it, compiled.
        names: of B such joints, in the MJCF.
        q: float64[T, J], of the logged joints (rad, m).
        qd: float64[T, J] (rad/s, m/s).
        qdd: float64[T, J] (rad/s^2, m/s^2).

    Returns:
        float64[T, B], the torque, and float64[T, B, B], the inertia that they would turn, without
        their own armature, which goes by the time step.
    """
    own = np.array([int(model.joint(name).dofadr[0]) for name in names])
    armature = np.diag(model.dof_armature[own])
    load = np.empty((len(q), len(own)))
    inertia = np.empty((len(q), len(own), len(own)))
    whole = np.empty((model.nv, model.nv))
    for index, data in enumerate(_inverted(plant, model, q, qd, qdd)):
        load[index] = data.qfrc_inverse[own]
        mujoco.mj_fullM(model, data, whole)
        inertia[index] = whole[np.ix_(own, own)] - armature
    return load, inertia


def _inverted(
    plant: Plant, model: mujoco.MjModel, q: Float64, qd: Float64, qdd: Float64
) -> Iterator[mujoco.MjData]:
    """Yield the arm at each instant of a motion, with the forces that it takes; one object."""
    data = mujoco.MjData(model)
    joints = [model.joint(name) for name in plant.joints]
    places = np.array([int(joint.qposadr[0]) for joint in joints])
    dofs = np.array([int(joint.dofadr[0]) for joint in joints])
    for index in range(len(q)):
        data.qpos[places], data.qvel[dofs], data.qacc[dofs] = q[index], qd[index], qdd[index]
        mujoco.mj_inverse(model, data)
        yield data


def given_torques(
    plant: Plant, model: mujoco.MjModel, q: Float64, qd: Float64, command: Float64
) -> Float64:
    """Return float64[T, J]: what the drives would give in a motion (N m, N).

    Args:
        plant: the arm; its actuators have no state of their own.
        model: of it, compiled.
        q: float64[T, J] (rad, m).
        qd: float64[T, J] (rad/s, m/s).
        command: float64[T, U], in force at each instant.
    """
    data = mujoco.MjData(model)
    joints = [model.joint(name) for name in plant.joints]
    places = np.array([int(joint.qposadr[0]) for joint in joints])
    dofs = np.array([int(joint.dofadr[0]) for joint in joints])
    first = [int(model.actuator_ctrladr[model.actuator(name).id]) for name in plant.actuators]
    count = [int(model.actuator_ctrlnum[model.actuator(name).id]) for name in plant.actuators]
    columns = np.concatenate(
        [np.arange(begin, begin + size) for begin, size in zip(first, count, strict=True)]
    )
    given = np.empty_like(q)
    for index in range(len(q)):
        data.qpos[places], data.qvel[dofs] = q[index], qd[index]
        data.ctrl[columns] = command[index]
        mujoco.mj_fwdPosition(model, data)
        mujoco.mj_fwdVelocity(model, data)
        mujoco.mj_fwdActuation(model, data)
        given[index] = data.qfrc_actuator[dofs]
    return given
