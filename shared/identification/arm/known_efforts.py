"""Torques that a recording knows: logged ones, or commands that are torques."""

import numpy as np

from shared.identification.dataset.types import Float64, Trajectory
from shared.sim.plant.rollouts import Rollouts
from shared.sim.plant.row import drives_of
from shared.sim.plant.signals import Signal, sampled


def known_effort_of(arm: Rollouts, of: Trajectory, at: Float64) -> Float64 | None:
    """Return float64[T, J]: torques (N m, N) at instants (s), as logged, else as commanded.

    None where neither says.
    """
    plant, model = arm.plant, arm.model
    if of.effort is not None and np.isfinite(of.effort).all():
        return sampled(of.joints_at, of.effort, at)
    if plant.control != "torque":
        return None
    commands = Signal(of.command_at, of.command).held(at)
    columns = {int(model.actuator(name).id): index for index, name in enumerate(plant.actuators)}
    out = np.zeros((len(at), len(plant.labels)))
    for joint, label in enumerate(plant.labels):
        for actuator in drives_of(plant, model, label):
            if actuator in columns:
                gear = float(model.actuator_gear[actuator, 0])
                out[:, joint] += gear * commands[:, columns[actuator]]
    return out
