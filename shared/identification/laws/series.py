"""A joint whose link does not stand where its motor does: what elasticity and backlash share.

The logged joint is the motor's side. A second joint carries the link, and the torque between them
is the load: what the link takes of gravity and inertia.
"""

from shared.identification.arm.subject import Subject
from shared.sim.plant.row import Row
from shared.sim.plant.structure import Builder, Edit, Structure


def series(subject: Subject, label: str, part: str) -> Structure:
    """Return what puts a second joint behind a logged one."""

    def change(builder: Builder) -> None:
        builder.series_joint(label, part)

    return (Edit(f"{part} {label}", change),)


def link_inertia(row: Row, joint: int) -> float:
    """Return the inertia behind an added joint in the home posture (kg m^2, kg)."""
    dof = int(row.model.jnt_dofadr[joint])
    return float(row.model.dof_M0[dof] - row.model.dof_armature[dof])
