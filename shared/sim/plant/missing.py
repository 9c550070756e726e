"""Torques that a measured motion takes beyond what the model's drives give there."""

import numpy as np

from shared.sim.arm import Float64
from shared.sim.plant.inverse import given_torques, inverse_dynamics, model_of
from shared.sim.plant.laws import frictions_of, torques_of
from shared.sim.plant.row import Row
from shared.sim.plant.step import Moment, Step


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
    model = model_of(row)
    given = given_torques(row.plant, model, q, qd, row.command.held(at))
    return inverse_dynamics(row.plant, model, q, qd, qdd) - given


def missing_beside_laws(
    row: Row, at: Float64, q: Float64, qd: Float64, qdd: Float64, command: Float64
) -> Float64:
    """Return float64[T, J]: the same without what the laws of torque and friction do (N m, N).

    Friction is taken to slide: what holds a joint at rest may be anything up to it. Laws that
    remember something are left out.

    Args:
        row: the arm, of a batch without added joints, with effects entered.
        at: float64[T], even instants (s).
        q: float64[T, J] (rad, m).
        qd: float64[T, J] (rad/s, m/s).
        qdd: float64[T, J] (rad/s^2, m/s^2).
        command: float64[T, U], in force at each instant.
    """
    plant, model = row.plant, model_of(row)
    drive = given_torques(plant, model, q, qd, command)
    missing = inverse_dynamics(plant, model, q, qd, qdd) - drive
    if not row.has_laws:
        return missing
    timestep = float(at[1] - at[0])
    still = np.zeros_like(q)
    moment = Moment(
        time=float(at[0]),
        timestep=timestep,
        q=q,
        qd=qd,
        qd_before=qd - timestep * qdd,
        drive=drive,
        drive_change=np.diff(drive, axis=0, prepend=drive[:1]),
        gravity=inverse_dynamics(plant, model, q, qd, still, is_of_links=True),
        rotors=np.tile(row.current("dof_armature")[row.dofs], (len(q), 1)),
    )
    step = Step(moment, slice(0, len(q)))  # each instant as an arm of its own
    for each in torques_of([row]):
        if not each.law.memory:
            values, none = np.tile(each.values, (len(q), 1)), np.empty((len(q), 0))
            missing -= each.law(step, values, none)
    for each in frictions_of([row]):
        missing += each.law(step, np.tile(each.values, (len(q), 1))) * np.sign(qd)
    return missing
