"""What must be compiled into an arm before an effect can enter it: more joints, other elements.

A structure is a tuple of edits. Two variants with the same edits share a compiled model.
"""

import copy
import math
from collections.abc import Callable
from dataclasses import dataclass

import mujoco
import numpy as np

from shared.sim.arm import Float64
from shared.sim.plant.plant import Plant

STIFF = 1e9
"""Of an added spring until an effect sets it, and the most there is (N m/rad)."""
NO_FORCE = 1e-12
"""A range of nothing is none to MuJoCo (N m, N)."""
_JOINT = (
    "type", "pos", "axis", "ref", "range", "limited", "margin", "stiffness", "springref",
    "springdamper", "damping", "armature", "frictionloss", "actfrcrange", "actfrclimited",
    "actgravcomp", "solref_limit", "solimp_limit", "solref_friction", "solimp_friction", "group",
)  # fmt: skip
"""All that a joint of an MJCF says of itself but its name."""


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

    def series_joint(self, label: str, part: str = "series") -> None:
        """Put a second joint between a logged joint's motor and its link.

        The first joint keeps name, motor, armature, friction and damping: it is what the encoder
        sees. The second, ``NAME/part``, has the same axis and is as good as locked until an
        effect calls :meth:`Row.spring`. Drives, those of a pose included, act on the first alone.
        """
        motor = self.spec.joint(self.plant.mj_joint(label))
        made = motor.parent.add_joint(
            name=series_name(self.plant, label, part),
            type=motor.type,
            axis=motor.axis,
            pos=motor.pos,
            actfrclimited=mujoco.mjtLimited.mjLIMITED_TRUE,
            actfrcrange=(-NO_FORCE, NO_FORCE),
        )
        self._lock(made)

    def base_joint(self, axis: tuple[float, float, float], name: str) -> None:
        """Let what the arm stands on turn about an axis at its origin, before anything else moves.

        As good as locked until an effect calls :meth:`Row.spring`. What a tracker is measured from
        stays where it was.
        """
        body = self.spec.body(self.plant.base_body)
        made = body.add_joint(name=name, type=mujoco.mjtJoint.mjJNT_HINGE, axis=axis)
        self._lock(made)
        joints = list(body.joints)
        kept = [{field: _copied(joint, field) for field in _JOINT} for joint in joints]
        names = [joint.name for joint in joints]
        for index, joint in enumerate(joints):
            joint.name = f"{name} {index}"
        for joint, values, own in zip(
            joints, (kept[-1], *kept[:-1]), (names[-1], *names[:-1]), strict=True
        ):
            joint.name = own
            for field, value in values.items():
                setattr(joint, field, value)
        self._fix_tracker(body)
        # What stands still may have no mass, what moves must.
        self.spec.compiler.boundmass = max(self.spec.compiler.boundmass, 1e-6)
        self.spec.compiler.boundinertia = max(self.spec.compiler.boundinertia, 1e-9)

    def _lock(self, joint: mujoco.MjsJoint) -> None:
        joint.stiffness[0] = STIFF
        joint.damping[0] = math.sqrt(STIFF)
        joint.armature = armature_for(STIFF, self.plant.timestep)

    def _fix_tracker(self, body: mujoco.MjsBody) -> None:
        """Measure the tracker from the world if it is measured from a site of this body."""
        for sensor in self.spec.sensors:
            site = self.spec.site(sensor.refname) if sensor.refname else None
            if site is None or site.parent.name != body.name:
                continue
            fixed = f"{sensor.refname}/fixed"
            if self.spec.site(fixed) is None:
                turned = np.empty(4)
                place = np.empty(3)
                mujoco.mju_mulQuat(turned, body.quat, site.quat)
                mujoco.mju_rotVecQuat(place, site.pos, body.quat)
                self.spec.worldbody.add_site(name=fixed, pos=body.pos + place, quat=turned)
            sensor.refname = fixed


def armature_for(stiffness: float, timestep: float) -> float:
    """Return the armature with which a spring is stable whatever it carries (kg m^2).

    MuJoCo takes springs explicitly: k h^2 / I must stay below 4. Slow motion does not feel it.
    """
    return 0.5 * stiffness * timestep**2


def series_name(plant: Plant, label: str, part: str = "series") -> str:
    """Return the MJCF's name of the joint that :meth:`Builder.series_joint` adds."""
    return f"{plant.mj_joint(label)}/{part}"


def series_joints(plant: Plant, model: mujoco.MjModel, label: str) -> list[int]:
    """Return the joints of a model that turn the link of a logged one: itself, those added to it.

    Args:
        plant: the arm.
        model: of it, with whatever was added.
        label: the logged joint.
    """
    first, added = plant.mj_joint(label), series_name(plant, label, "")
    names = [model.joint(index).name for index in range(model.njnt)]
    return [index for index, name in enumerate(names) if name == first or name.startswith(added)]


def link_sums(plant: Plant, model: mujoco.MjModel) -> Float64:
    """Return float64[Q, J] of ones and zeros: positions, or speeds, times it are the links'.

    All joints are hinges and slides, so that both are in the same places of a state.

    Args:
        plant: the arm.
        model: of it, with whatever was added.
    """
    out = np.zeros((model.nq, len(plant.labels)))
    for index, label in enumerate(plant.labels):
        out[model.jnt_qposadr[series_joints(plant, model, label)], index] = 1.0
    return out


def compiled(plant: Plant, structure: Structure) -> mujoco.MjModel:
    """Return the arm with edits in it."""
    builder = Builder(plant)
    for edit in structure:
        edit.change(builder)
    for body in builder.spec.bodies:
        body.simple = False  # else a lone link whose centre moves is refused
    return builder.spec.compile()


def _copied(joint: mujoco.MjsJoint, field: str) -> object:
    return copy.copy(getattr(joint, field))  # arrays are views of the spec
