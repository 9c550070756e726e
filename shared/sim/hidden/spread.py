"""What is different about every robot: its dampers, gears and gains, and how heavy its links are.

The first is what a base fit is for. The second, on top of a finer time step, is what makes a base
model imperfect: it has a factor for each link, but not for mass and inertia apart.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from shared.sim.arm import Float64
from shared.sim.hidden.arms import HiddenArm
from shared.sim.hidden.robot import Robot

_MOST: Final = 2.0
"""Standard deviations that a draw is cut at."""
_CENTRE_M: Final = 0.004
"""Standard deviation of a link's centre of mass where the base is to be imperfect (m)."""


@dataclass(frozen=True)
class Spread:
    """One robot of a series; factors of what the model file says."""

    damping: Float64
    """float64[J]."""
    armature: Float64
    """float64[J]."""
    friction: Float64
    """float64[J]."""
    added_friction: Float64
    """float64[J], where the model file has none (N m)."""
    kp: Float64
    """float64[U]."""
    kv: Float64
    """float64[U]."""
    mass: Float64
    """float64[J], of the link that a joint carries; 1 with a perfect base."""
    inertia: Float64
    """float64[J]."""
    centre: Float64
    """float64[J, 3] (m)."""


def draw(arm: HiddenArm, share: float, is_imperfect: bool, rng: np.random.Generator) -> Spread:
    """Return a robot drawn at random.

    Args:
        arm: of which series.
        share: standard deviation of the logarithm of each factor; 0 is the model file's robot.
        is_imperfect: links weigh and turn up to 10 % more or less, too.
        rng: what is drawn from.
    """
    if not share:
        return nominal(arm)
    joints, actuators = len(arm.rest), len(arm.make().actuators)

    def factors(count: int) -> Float64:
        return np.exp(share * np.clip(rng.standard_normal(count), -_MOST, _MOST))

    found = Spread(
        damping=factors(joints),
        armature=factors(joints),
        friction=factors(joints),
        added_friction=arm.torque * rng.uniform(0.01, 0.04, joints),
        kp=factors(actuators),
        kv=factors(actuators),
        mass=rng.uniform(0.9, 1.1, joints),
        inertia=rng.uniform(0.9, 1.1, joints),
        centre=_CENTRE_M * rng.standard_normal((joints, 3)),
    )
    if is_imperfect:
        return found
    return nominal(arm, like=found)


def nominal(arm: HiddenArm, like: Spread | None = None) -> Spread:
    """Return the robot of the model file; with ``like``, only its links are as in the file."""
    joints, actuators = len(arm.rest), len(arm.make().actuators)
    ones = np.ones(joints)
    return Spread(
        damping=ones if like is None else like.damping,
        armature=ones if like is None else like.armature,
        friction=ones if like is None else like.friction,
        added_friction=0.0 * ones if like is None else like.added_friction,
        kp=np.ones(actuators) if like is None else like.kp,
        kv=np.ones(actuators) if like is None else like.kv,
        mass=ones,
        inertia=ones,
        centre=np.zeros((joints, 3)),
    )


def enter(robot: Robot, spread: Spread) -> None:
    """Make an uncompiled robot that one of the series."""
    for index, label in enumerate(robot.plant.labels):
        joint = robot.joint(label)
        joint.damping[0] *= spread.damping[index]
        joint.armature *= spread.armature[index]
        if joint.frictionloss > 0.0:
            joint.frictionloss *= spread.friction[index]
        elif robot.plant.control == "pose":
            joint.frictionloss = spread.added_friction[index]
        body = joint.parent
        body.mass *= spread.mass[index]
        body.ipos = np.asarray(body.ipos) + spread.centre[index]
        if np.isfinite(body.fullinertia[0]):
            body.fullinertia = np.asarray(body.fullinertia) * spread.inertia[index]
        else:
            body.inertia = np.asarray(body.inertia) * spread.inertia[index]
    if robot.plant.control == "torque":
        return
    for index, name in enumerate(robot.plant.actuators):
        actuator = robot.spec.actuator(name)
        actuator.gainprm[0] *= spread.kp[index]
        actuator.biasprm[1] *= spread.kp[index]
        actuator.biasprm[2] *= spread.kv[index]


def directions(arm: HiddenArm) -> list[Callable[[Robot], None]]:
    """Return what a base fit can do to a robot, each by a small step, after it is compiled.

    Only the size of a hidden effect is measured with them: what they can make up for does not
    count. How heavy links are is left out: a base fit is held to what is known of that.
    """
    found: list[Callable[[Robot], None]] = []
    for index in range(len(arm.rest)):
        found += [_joint_step(index, "dof_damping"), _joint_step(index, "dof_armature")]
        found.append(_friction_step(arm, index))
    if arm.control != "torque":
        for index in range(len(arm.make().actuators)):
            found += [_gain_step(index, 1), _gain_step(index, 2)]
    return found


_STEP: Final = 0.05
"""Of a factor."""


def _joint_step(index: int, field: str) -> Callable[[Robot], None]:
    def change(robot: Robot) -> None:
        dof = int(robot.model.joint(robot.plant.joints[index]).dofadr[0])
        getattr(robot.model, field)[dof] *= 1.0 + _STEP

    return change


def _friction_step(arm: HiddenArm, index: int) -> Callable[[Robot], None]:
    def change(robot: Robot) -> None:
        dof = int(robot.model.joint(robot.plant.joints[index]).dofadr[0])
        robot.model.dof_frictionloss[dof] += 0.003 * arm.torque[index]

    return change


def _gain_step(index: int, part: int) -> Callable[[Robot], None]:
    def change(robot: Robot) -> None:
        actuator = int(robot.model.actuator(robot.plant.actuators[index]).id)
        robot.model.actuator_biasprm[actuator, part] *= 1.0 + _STEP
        if part == 1:
            robot.model.actuator_gainprm[actuator, 0] *= 1.0 + _STEP

    return change
