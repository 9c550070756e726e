"""What must be compiled into an arm before an effect can enter it: more joints, other elements.

A structure is a tuple of edits. Two variants with the same edits share a compiled model.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import mujoco

from shared.sim.plant.plant import Plant

STIFF = 1e9
"""Of an added spring until an effect sets it (N m/rad)."""


@dataclass(frozen=True)
class Edit:
    """One change, told apart by its name."""

    name: str
    """What is added and where: ``series shoulder_pan``."""
    change: Callable[["Builder"], None]

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Edit) and other.name == self.name

    def __hash__(self) -> int:
        return hash(self.name)


Structure = tuple[Edit, ...]


class Builder:
    """The arm while it is being changed."""

    def __init__(self, plant: Plant) -> None:
        self.plant = plant
        self.spec = plant.make()

    def series_joint(self, label: str) -> None:
        """Put a second joint between a logged joint's motor and its link.

        The first joint keeps name, motor, armature, friction and damping: it is what the encoder
        sees. The second, ``NAME/series``, has the same axis and a spring that an effect sets.
        """
        motor = self.spec.joint(self.plant.mj_joint(label))
        made = motor.parent.add_joint(
            name=series_name(self.plant, label), type=motor.type, axis=motor.axis, pos=motor.pos
        )
        made.stiffness[0] = STIFF
        made.damping[0] = math.sqrt(STIFF) * 1e-3

    def base_joint(self, axis: tuple[float, float, float], name: str) -> None:
        """Let what the arm stands on turn about an axis at its origin, against a spring."""
        made = self.spec.body(self.plant.base_body).add_joint(
            name=name, type=mujoco.mjtJoint.mjJNT_HINGE, axis=axis
        )
        made.stiffness[0] = STIFF
        made.armature = 1.0


def series_name(plant: Plant, label: str) -> str:
    """Return the MJCF's name of the joint that :meth:`Builder.series_joint` adds."""
    return f"{plant.mj_joint(label)}/series"


def compiled(plant: Plant, structure: Structure) -> mujoco.MjModel:
    """Return the arm with edits in it."""
    builder = Builder(plant)
    for edit in structure:
        edit.change(builder)
    return builder.spec.compile()
