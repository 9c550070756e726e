"""One thing that an arm does and its file does not know, drawn at random."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final

import mujoco
import numpy as np

from shared.identification.dataset.types import Float64
from studies.other_arms.arms import Arm

Law = Callable[[Float64, Float64], Float64]
"""Torques float64[J] by positions and speeds float64[J]."""


def _nothing(q: Float64, qd: Float64) -> Float64:
    return np.zeros_like(q)


@dataclass(frozen=True)
class Fault:
    """What is wrong, and with what name the finder would be right."""

    name: str = "none"
    where: str = ""
    """Joint; empty for the whole arm."""
    value: float = 0.0
    unit: str = ""
    law: Law = field(default=_nothing)
    """More torque at the joints."""
    edit: Callable[[mujoco.MjModel], None] = lambda model: None
    """Of the compiled arm."""
    delay: float = 0.0
    """Of commands (s)."""
    hold: float = 0.0
    """For which a command is kept (s)."""

    def __str__(self) -> str:
        """Return it in words."""
        return " ".join(filter(None, (self.name, self.where, f"{self.value:.4g}", self.unit)))


def draw(name: str, arm: Arm, rng: np.random.Generator) -> Fault:
    """Return a fault of that name, at a random joint and of a random size.

    Args:
        name: of FAULTS, or ``none``.
        arm: has it.
        rng: random numbers.
    """
    return FAULTS[name](arm, int(rng.integers(len(arm.joints))), float(rng.uniform(0.5, 1.5)))


def _at(joint: int, torque: Callable[[float, float], float]) -> Law:
    def law(q: Float64, qd: Float64) -> Float64:
        out = np.zeros_like(q)
        out[joint] = torque(float(q[joint]), float(qd[joint]))
        return out

    return law


def _bias(arm: Arm, joint: int, size: float) -> Fault:
    value = 0.015 * size * float(arm.limit[joint])
    return Fault("torque_bias", arm.joints[joint], value, "N m", _at(joint, lambda q, qd: value))


def _drag(arm: Arm, joint: int, size: float) -> Fault:
    value = 0.8 * size * float(arm.numbers.damping[joint])
    law = _at(joint, lambda q, qd: -value * qd * abs(qd))
    return Fault("nonlinear_viscous", arm.joints[joint], value, "N m s2/rad2", law)


def _stribeck(arm: Arm, joint: int, size: float) -> Fault:
    value = 0.8 * size * float(arm.numbers.friction[joint])
    law = _at(joint, lambda q, qd: -value * np.tanh(qd / 3e-3) * np.exp(-((qd / 0.1) ** 2)))
    return Fault("stribeck_friction", arm.joints[joint], value, "N m", law)


def _one_way(arm: Arm, joint: int, size: float) -> Fault:
    value = 0.4 * size * float(arm.numbers.damping[joint])
    law = _at(joint, lambda q, qd: -value * abs(qd))
    return Fault("asymmetric_friction", arm.joints[joint], value, "N m s/rad", law)


def _ripples(arm: Arm, joint: int, size: float) -> Fault:
    value = 0.01 * size * float(arm.limit[joint])
    per = 300.0 if arm.links[joint].kind == "slide" else 12.0
    law = _at(joint, lambda q, qd: value * np.sin(per * q))
    return Fault("cogging", arm.joints[joint], value, "N m", law)


def _spring(arm: Arm, joint: int, size: float) -> Fault:
    value = 0.02 * size * float(arm.limit[joint] / arm.swing[joint])

    def edit(model: mujoco.MjModel) -> None:
        model.jnt_stiffness[joint], model.qpos_spring[joint] = value, arm.home[joint]

    return Fault("joint_spring", arm.joints[joint], value, "N m/rad", edit=edit)


def _payload(arm: Arm, joint: int, size: float) -> Fault:
    value = 0.25 * size * sum(link.mass for link in arm.links[-2:])

    def edit(model: mujoco.MjModel) -> None:
        hang(model, model.nbody - 1, model.site("tool").pos, value)

    return Fault("payload", "", value, "kg", edit=edit)


def hang(model: mujoco.MjModel, body: int, at: Float64, mass: float) -> None:
    """Fix a point mass to a body of an arm (Steiner's theorem about the centre of both).

    Args:
        model: compiled.
        body: its number.
        at: float64[3], where on the body (m).
        mass: of the point (kg).
    """
    own, apart = float(model.body_mass[body]), at - model.body_ipos[body]
    share = mass / (own + mass)
    more = own * share * (apart @ apart * np.eye(3) - np.outer(apart, apart))
    axes = np.zeros(9)
    mujoco.mju_quat2Mat(axes, model.body_iquat[body])
    turned = axes.reshape(3, 3)
    principal, vectors = np.linalg.eigh(
        turned @ np.diag(model.body_inertia[body]) @ turned.T + more
    )
    vectors[:, 0] *= np.sign(np.linalg.det(vectors))  # a rotation, no mirror
    mujoco.mju_mat2Quat(model.body_iquat[body], vectors.ravel())
    model.body_inertia[body] = principal
    model.body_mass[body] = own + mass
    model.body_ipos[body] += share * apart
    mujoco.mj_setConst(model, mujoco.MjData(model))


def _weak(arm: Arm, joint: int, size: float) -> Fault:
    value = -0.2 * size

    def edit(model: mujoco.MjModel) -> None:
        model.actuator_gear[joint, 0] *= 1.0 + value

    return Fault("torque_gain", arm.joints[joint], value, "share", edit=edit)


def _limit(arm: Arm, joint: int, size: float) -> Fault:
    value = 0.4 + 0.3 * size
    return Fault("torque_saturation", arm.joints[joint], value, "of its peak")


def _late(arm: Arm, joint: int, size: float) -> Fault:
    value = 0.02 * size
    return Fault("command_latency", "", value, "s", delay=value)


def _held(arm: Arm, joint: int, size: float) -> Fault:
    value = round(0.05 * size, 3)
    return Fault("sample_and_hold", "", value, "s", hold=value)


FAULTS: Final[dict[str, Callable[[Arm, int, float], Fault]]] = {
    "none": lambda arm, joint, size: Fault(),
    "bias": _bias, "drag": _drag, "stribeck": _stribeck, "one_way": _one_way,
    "ripples": _ripples, "spring": _spring, "payload": _payload, "weak": _weak,
    "limit": _limit, "late": _late, "held": _held,
}  # fmt: skip
ABSORBED: Final = {("position", "weak")}
"""By a servo's own gains, which a base fit finds: nothing is wrong then."""
