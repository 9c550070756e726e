"""Sites that are off by a rigid motion, in the place of those that should be there."""

import mujoco
import numpy as np

from shared.sim.arm import Float64
from shared.sim.hidden.effect import Case, Values, direction
from shared.sim.hidden.robot import Robot
from shared.sim.plant.plant import TOOL

_TURN = 2.0
"""A frame that is off by a metre is turned by so much (rad)."""


def parts(case: Case) -> Float64:
    """Return float64[6]: translation (m), as long as the size, and rotation vector (rad)."""
    return np.concatenate(
        [case.size * direction(case.shape[:2]), _TURN * case.size * direction(case.shape[2:])]
    )


def values(case: Case) -> Values:
    """Return the six by their names."""
    names = ("x", "y", "z", "turn_x", "turn_y", "turn_z")
    units = ("m", "m", "m", "rad", "rad", "rad")
    numbers = parts(case).tolist()
    return {name: (number, unit) for name, number, unit in zip(names, numbers, units, strict=True)}


def quaternion(vector: Float64) -> Float64:
    """Return float64[4] of a rotation vector (rad)."""
    angle = float(np.linalg.norm(vector))
    out = np.empty(4)
    mujoco.mju_axisAngle2Quat(out, vector / max(angle, 1e-12), angle)
    return out


def move_tracked(robot: Robot, by: Float64) -> None:
    """Fix the tracker elsewhere on the tool: float64[6] in the frame that it should have."""
    for sensor in robot.spec.sensors:
        if not sensor.name.startswith(TOOL):
            continue
        site = robot.spec.site(sensor.objname)
        name = f"{sensor.objname} in truth"
        if robot.spec.site(name) is None:
            place, turned = _moved(site.pos, site.quat, by)
            site.parent.add_site(name=name, pos=place, quat=turned)
        sensor.objname = name


def move_reference(robot: Robot, by: Float64) -> None:
    """Let the tracker measure from another frame: float64[6] in that it should measure from."""
    name = "tracker's base"
    for sensor in robot.spec.sensors:
        if not sensor.name.startswith(TOOL):
            continue
        if robot.spec.site(name) is None:
            site = robot.spec.site(sensor.refname) if sensor.refname else None
            body = robot.spec.worldbody if site is None else site.parent
            place, turned = _moved(
                np.zeros(3) if site is None else site.pos,
                np.array([1.0, 0.0, 0.0, 0.0]) if site is None else site.quat,
                by,
            )
            body.add_site(name=name, pos=place, quat=turned)
        sensor.reftype, sensor.refname = mujoco.mjtObj.mjOBJ_SITE, name


def move_commands(robot: Robot, by: Float64) -> None:
    """Let commanded poses be meant in another frame: float64[6] in that they should be meant in."""
    name = "commands' base"
    for actuator in robot.spec.actuators:
        site = robot.spec.site(actuator.refsite)
        if robot.spec.site(name) is None:
            place, turned = _moved(site.pos, site.quat, by)
            site.parent.add_site(name=name, pos=place, quat=turned)
        actuator.refsite = name


def _moved(pos: Float64, quat: Float64, by: Float64) -> tuple[Float64, Float64]:
    """Return position and quaternion of a frame that is off by something in its own frame."""
    place, turned = np.empty(3), np.empty(4)
    unit = np.asarray(quat, np.float64) / np.linalg.norm(quat)
    mujoco.mju_rotVecQuat(place, by[:3], unit)
    mujoco.mju_mulQuat(turned, unit, quaternion(by[3:]))
    return np.asarray(pos, np.float64) + place, turned
