"""Which joints an effect may sit at, and what a torque of one is measured against."""

from dataclasses import dataclass

from shared.identification.arm.subject import Subject
from shared.sim.plant.row import Row

_MOVED = 0.05
"""Travel from which a joint's data show what acts on it (rad)."""
_SLID = 0.005
"""The same of a sliding joint (m)."""
_SLIDE = 2
"""``mjJNT_SLIDE``."""
_IDLE = 0.05
"""Of a torque limit: no less is a joint's scale, however gently it was moved."""


@dataclass(frozen=True)
class Place:
    """A logged joint of a subject, as effects measure it."""

    label: str
    dof: int
    """Of the nominal model."""
    joint: int
    """Of the nominal model."""
    is_sliding: bool
    travel: float
    """(rad, m)."""
    lowest: float
    """(rad, m)."""
    speed: float
    """What it exceeds 2 % of the time, never 0 (rad/s, m/s)."""
    acceleration: float
    """The same (rad/s^2, m/s^2)."""
    inertia: float
    """About the joint, armature included, in the model's home posture (kg m^2, kg)."""
    drive: float
    """Torque that it takes 2 % of the time, never 0 (N m, N)."""

    @property
    def angle(self) -> str:
        """Return the unit of a position."""
        return "m" if self.is_sliding else "rad"

    @property
    def torque(self) -> str:
        """Return the unit of a torque."""
        return "N" if self.is_sliding else "N m"

    @property
    def moves(self) -> bool:
        """Whether its data show what acts on it."""
        return self.travel > (_SLID if self.is_sliding else _MOVED)


def place_of(subject: Subject, label: str) -> Place:
    """Return a logged joint by its name."""
    index = subject.joints.index(label)
    model = subject.nominal.model
    mj_joint = model.joint(subject.plant.mj_joint(label))
    dof, joint = int(mj_joint.dofadr[0]), int(mj_joint.id)
    inertia = float(model.dof_M0[dof])
    limit = float(model.jnt_actfrcrange[joint, 1]) if model.jnt_actfrclimited[joint] else 0.0
    return Place(
        label=label,
        dof=dof,
        joint=joint,
        is_sliding=int(model.jnt_type[joint]) == _SLIDE,
        travel=float(subject.travel[index]),
        lowest=float(subject.lowest[index]),
        speed=max(float(subject.speed[index]), 1e-3),
        acceleration=max(float(subject.acceleration[index]), 1e-3),
        inertia=inertia,
        drive=max(float(subject.drive[index]), _IDLE * limit, 0.01 * inertia),
    )


def moving(subject: Subject) -> tuple[Place, ...]:
    """Return the joints whose data show what acts on them."""
    places = (place_of(subject, label) for label in subject.joints)
    return tuple(place for place in places if place.moves)


def slides(row: Row, label: str) -> bool:
    """Return whether a logged joint of an arm is a sliding one."""
    return int(row.model.jnt_type[row.mj_joint(row.plant.mj_joint(label))]) == _SLIDE
