"""The PR2's arm as numbers: chain, limits and inertias, read from ``data/pr2_arm.toml``."""

from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Final, Literal

import msgspec
import numpy as np
from numpy.typing import NDArray

from shared.sim.config import JointName, Side

Float64 = NDArray[np.float64]
Vector3 = tuple[float, float, float]

_PATH: Final = Path(__file__).parent / "data" / "pr2_arm.toml"
_MIRRORED: Final = ("shoulder_pan", "upper_arm_roll")


@dataclass(frozen=True)
class Inertial:
    """A rigid body's mass (kg), centre of mass (m) and inertia about it (kg m^2), in its frame."""

    mass: float
    com: Float64
    """float64[3]."""
    inertia: Float64
    """float64[3, 3]."""


@dataclass(frozen=True)
class ArmJoint:
    """One joint and the links it carries rigidly."""

    name: JointName
    axis: Vector3
    origin: Vector3
    """In the frame of the joint before it; the first in the torso frame (m)."""
    range: tuple[float, float] | None
    """Soft limits (rad), or None for a continuous joint."""
    velocity_limit: float
    """rad/s."""
    effort_limit: float
    """N m."""
    safety_gains: tuple[float, float]
    """Of the robot's own limiter: 1/s from a soft limit to a velocity, N m s/rad from that to a
    torque; the first is 0 for a continuous joint."""
    feedforward: float
    """Effective inertia that the shipped pose controller's posture term uses (kg m^2)."""
    continuous_torque: float
    """What the shipped controllers' launch file gives as the joint's maximum (N m)."""
    inertial: Inertial


@dataclass(frozen=True)
class Arm:
    """One arm, from the torso to the gripper."""

    side: Side
    joints: tuple[ArmJoint, ...]
    tool: Vector3
    """The tool frame in the last joint's frame (m); no rotation."""


@dataclass(frozen=True)
class Stance:
    """Where the torso frame and the base of a robot are."""

    torso_height: float
    """torso_lift_link above the floor with the torso down (m)."""
    base_in_torso: Vector3
    """base_link in the torso frame with the torso down (m)."""
    base_size: Vector3
    """Box of the base (m)."""
    head_in_torso: Vector3
    """Head pan joint in the torso frame (m)."""


class _Scalar(msgspec.Struct):
    value: float


class _Vector(msgspec.Struct):
    value: Vector3


class _Safety(msgspec.Struct):
    k_velocity: float
    k_position: float = 0.0
    soft_lower_right: float | None = None
    soft_upper_right: float | None = None


class _Joint(msgspec.Struct):
    name: JointName
    type: Literal["revolute", "continuous"]
    axis: _Vector
    origin_xyz: _Vector
    velocity_limit: _Scalar
    effort_limit: _Scalar
    jt_feedforward: _Scalar
    jt_max_effort: _Scalar
    safety: _Safety


class _Link(msgspec.Struct):
    name: str
    joint: JointName
    mass_kg: float
    com_m: Vector3
    inertia_kg_m2: tuple[float, float, float, float, float, float]
    offset_m: Vector3
    side: Side | None = None
    dummy: bool = False


class _Base(msgspec.Struct):
    footprint_to_base_link_z: _Scalar
    base_box_size: _Vector


class _Torso(msgspec.Struct):
    base_link_to_torso_lift_link: _Vector
    head_pan_in_torso: _Vector


class _Mount(msgspec.Struct):
    r_shoulder_pan_in_torso: _Vector
    l_shoulder_pan_in_torso: _Vector


class _Gripper(msgspec.Struct):
    tool_frame_in_palm: _Vector


class _File(msgspec.Struct):
    base: _Base
    torso: _Torso
    shoulder_mount: _Mount
    gripper: _Gripper
    joints: tuple[_Joint, ...]
    links: tuple[_Link, ...]


@cache
def _file() -> _File:
    return msgspec.toml.decode(_PATH.read_bytes(), type=_File)


@cache
def load_arm(side: Side) -> Arm:
    """Return the right or the left arm."""
    file = _file()
    mount = file.shoulder_mount
    shoulder = mount.r_shoulder_pan_in_torso if side == "right" else mount.l_shoulder_pan_in_torso
    joints = tuple(
        ArmJoint(
            name=joint.name,
            axis=joint.axis.value,
            origin=shoulder.value if joint.name == "shoulder_pan" else joint.origin_xyz.value,
            range=_soft_range(joint, side),
            velocity_limit=joint.velocity_limit.value,
            effort_limit=joint.effort_limit.value,
            safety_gains=(joint.safety.k_position, joint.safety.k_velocity),
            feedforward=joint.jt_feedforward.value,
            continuous_torque=joint.jt_max_effort.value,
            inertial=_carried(file.links, joint.name, side),
        )
        for joint in file.joints
    )
    return Arm(side=side, joints=joints, tool=file.gripper.tool_frame_in_palm.value)


@cache
def load_stance() -> Stance:
    """Return where a standing robot's frames are."""
    file = _file()
    forward, left, up = file.torso.base_link_to_torso_lift_link.value
    return Stance(
        torso_height=file.base.footprint_to_base_link_z.value + up,
        base_in_torso=(-forward, -left, -up),
        base_size=file.base.base_box_size.value,
        head_in_torso=file.torso.head_pan_in_torso.value,
    )


def combine(parts: list[Inertial]) -> Inertial:
    """Return several rigidly joined bodies as one (parallel-axis theorem)."""
    mass = sum(part.mass for part in parts)
    com = sum((part.mass * part.com for part in parts), np.zeros(3)) / mass
    inertia = np.zeros((3, 3))
    for part in parts:
        offset = part.com - com
        inertia += part.inertia + part.mass * (
            offset @ offset * np.eye(3) - np.outer(offset, offset)
        )
    return Inertial(mass=mass, com=com, inertia=inertia)


def _soft_range(joint: _Joint, side: Side) -> tuple[float, float] | None:
    lower, upper = joint.safety.soft_lower_right, joint.safety.soft_upper_right
    if lower is None or upper is None:
        return None
    return (-upper, -lower) if side == "left" and joint.name in _MIRRORED else (lower, upper)


def _carried(links: tuple[_Link, ...], joint: JointName, side: Side) -> Inertial:
    """Return the links that move with ``joint``; the source's placeholder inertias are left out.

    The rotors are what those placeholders stand for; they enter as the joints' armature.
    """
    return combine(
        [
            Inertial(
                link.mass_kg, np.array(link.com_m) + link.offset_m, _matrix(link.inertia_kg_m2)
            )
            for link in links
            if link.joint == joint and link.side in (None, side) and not link.dummy
        ]
    )


def _matrix(six: tuple[float, float, float, float, float, float]) -> Float64:
    xx, yy, zz, xy, xz, yz = six
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
