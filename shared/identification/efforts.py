"""How hard each joint was driven while a recording was made."""

import numpy as np

from shared.identification.dataset.types import Float64, Trajectory
from shared.identification.motion import motion_of
from shared.identification.subject import Subject
from shared.sim.plant.inverse import inverse_dynamics
from shared.sim.plant.row import drives_of
from shared.sim.plant.signals import Signal, sampled

_SPARSE = 3
"""Of the instants of a motion, every so many say what torque it takes."""


def effort_of(subject: Subject, of: Trajectory, at: Float64) -> Float64:
    """Return float64[T, J]: torques (N m, N) at instants (s).

    As they were logged; else as they were commanded, where commands are torques; else what the
    motion takes of the nominal arm.
    """
    if of.effort is not None and np.isfinite(of.effort).all():
        return sampled(of.joints_at, of.effort, at)
    if subject.control == "torque":
        return _commanded(subject, of, at)
    motion = motion_of(of).sparse(_SPARSE)
    torque = inverse_dynamics(subject.plant, subject.nominal.model, motion.q, motion.qd, motion.qdd)
    return sampled(motion.at, torque, at)


def _commanded(subject: Subject, of: Trajectory, at: Float64) -> Float64:
    model, plant = subject.nominal.model, subject.plant
    commands = Signal(of.command_at, of.command).held(at)
    columns = {int(model.actuator(name).id): index for index, name in enumerate(plant.actuators)}
    out = np.zeros((len(at), len(plant.labels)))
    for joint, label in enumerate(plant.labels):
        for actuator in drives_of(plant, model, label):
            if actuator in columns:
                gear = float(model.actuator_gear[actuator, 0])
                out[:, joint] += gear * commands[:, columns[actuator]]
    return out
