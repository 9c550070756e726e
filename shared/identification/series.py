"""A joint whose link does not stand where its motor does: what elasticity and backlash share.

The logged joint is the motor's side. A second joint carries the link, and the torque between them
is the load: what the link takes of gravity and inertia.
"""

from collections.abc import Callable

import numpy as np

from shared.identification.dataset.types import Float64
from shared.identification.subject import Subject
from shared.sim.plant.inverse import inverse_dynamics
from shared.sim.plant.row import Row
from shared.sim.plant.signals import Signal, sampled
from shared.sim.plant.structure import JOINT_MOTORS, Builder, Edit, Structure
from shared.sim.plant.targets import as_if_at

_PERIOD = 0.02
"""Of the instants at which a recording's load is taken (s)."""
_AROUND = 0.2
"""Either side of what is replayed, of which the load is taken too (s)."""


def series(subject: Subject, label: str, part: str) -> Structure:
    """Return what puts a second joint behind a logged one."""

    def change(builder: Builder) -> None:
        builder.series_joint(label, part)

    joint = Edit(f"{part} {label}", change)
    return (joint, JOINT_MOTORS) if subject.control == "pose" else (joint,)


def link_inertia(row: Row, joint: int) -> float:
    """Return the inertia behind an added joint in the home posture (kg m^2, kg)."""
    dof = int(row.model.jnt_dofadr[joint])
    return float(row.model.dof_M0[dof] - row.model.dof_armature[dof])


def hide_from_controller(row: Row, label: str, bent: Callable[[Float64], Float64]) -> None:
    """Let a controller of poses not know that the link is off its motor.

    A pose controller takes the tool to be where the encoders say: its target is off by what the
    link is off from its motor, with the load that the logged motion takes.

    Args:
        row: the arm.
        label: the logged joint.
        bent: turns loads float64[T] (N m, N) into how far the link is off its motor (rad, m).
    """
    if row.plant.control != "pose":
        return
    logged = row.logged_q
    true = Signal(*_followed(row, label, bent))
    row.on_target(lambda target: as_if_at(row, target, logged, true))


def _followed(row: Row, label: str, bent: Callable[[Float64], Float64]) -> tuple[Float64, Float64]:
    """Return instants, and where the links are there if the motors are where the log has them."""
    log = row.logged_q
    is_near = (log.at >= -_AROUND) & (log.at <= row.duration + _AROUND)
    logged = Signal(log.at[is_near], log.values[is_near])
    at: Float64 = np.arange(float(logged.at[0]), float(logged.at[-1]), _PERIOD, dtype=np.float64)
    # A local mean takes the encoders' noise off before it is differentiated twice.
    near = np.linspace(-1.0, 1.0, 9) * _PERIOD
    q = np.mean([sampled(logged.at, logged.values, at + shift) for shift in near], axis=0)
    qd = np.gradient(q, _PERIOD, axis=0)
    qdd = np.gradient(qd, _PERIOD, axis=0)
    load = inverse_dynamics(row.plant, row.model, q, qd, qdd, is_of_links=True)
    joint = row.plant.labels.index(label)
    true = logged.values.copy()  # not the local mean: a link that is not off stays where it was
    true[:, joint] += np.interp(logged.at, at, bent(load[:, joint]))
    return logged.at, true
