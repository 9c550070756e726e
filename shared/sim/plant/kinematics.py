"""Where the tool is at many postures at once, by the kinematics of the model."""

from dataclasses import dataclass

import mujoco
import numpy as np

from shared.sim.arm import Float64
from shared.sim.plant.plant import TOOL, Plant
from shared.sim.plant.poses import conjugate, inverse, product, rotated, seen_from, turn

_HOME = np.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0])


def tool_poses(plant: Plant, model: mujoco.MjModel, q: Float64) -> Float64:
    """Return float64[T, 7]: what a tracker without error would say.

    Joints that are not logged stand where the model has them.

    Args:
        plant: the arm.
        model: of it, compiled; its nominal numbers.
        q: float64[T, J], logged joints (rad, m).
    """
    tool, base = _ends(plant, model, q)
    return tool.pose if base is None else seen_from(inverse(base.pose), tool.pose)


def tool_motion(plant: Plant, model: mujoco.MjModel, q: Float64) -> tuple[Float64, Float64]:
    """Return :func:`tool_poses` and their Jacobian, of the same arguments.

    The Jacobian, float64[T, 6, J], makes velocity and angular velocity of the joints' velocities,
    in the frame of the poses, which no logged joint moves.
    """
    tool, base = _ends(plant, model, q)
    jacobian = np.zeros((len(q), 6, len(plant.joints)))
    for column, joint in tool.joints.items():
        if joint.is_slide:
            jacobian[:, :3, column] = joint.axis
        else:
            jacobian[:, :3, column] = np.cross(joint.axis, tool.pose[:, :3] - joint.anchor)
            jacobian[:, 3:, column] = joint.axis
    if base is None:
        return tool.pose, jacobian
    back = conjugate(base.pose[:, None, 3:])
    for part in (slice(0, 3), slice(3, 6)):
        jacobian[:, part] = rotated(back, jacobian[:, part].swapaxes(1, 2)).swapaxes(1, 2)
    return seen_from(inverse(base.pose), tool.pose), jacobian


@dataclass(frozen=True)
class _Joint:
    """A joint in the world, at each posture."""

    anchor: Float64
    """float64[T, 3] (m)."""
    axis: Float64
    """float64[T, 3]."""
    is_slide: bool


@dataclass
class _End:
    """What a chain of bodies ends in."""

    pose: Float64
    """float64[T, 7] in the world."""
    joints: dict[int, _Joint]
    """By column of the postures."""


def _ends(plant: Plant, model: mujoco.MjModel, q: Float64) -> tuple[_End, _End | None]:
    """Return the tool, and what its pose is measured from; None is the world."""
    sensor = int(model.sensor(f"{TOOL}/position").id)
    columns = {int(model.joint(name).id): index for index, name in enumerate(plant.joints)}
    kind, index = int(model.sensor_objtype[sensor]), int(model.sensor_objid[sensor])
    tool = _end(model, kind, index, columns, q)
    if model.sensor_refid[sensor] < 0:
        return tool, None
    kind, index = int(model.sensor_reftype[sensor]), int(model.sensor_refid[sensor])
    return tool, _end(model, kind, index, columns, q)


def _end(model: mujoco.MjModel, kind: int, index: int, columns: dict[int, int], q: Float64) -> _End:
    """Return where a site or a body is."""
    is_site = kind == int(mujoco.mjtObj.mjOBJ_SITE)
    body = int(model.site_bodyid[index]) if is_site else index
    chain: list[int] = []
    while body:
        chain.append(body)
        body = int(model.body_parentid[body])
    end = _End(np.tile(_HOME, (len(q), 1)), {})
    for link in reversed(chain):
        here = np.concatenate([model.body_pos[link], model.body_quat[link]])
        end.pose = seen_from(end.pose, here)
        first = int(model.body_jntadr[link])
        for joint in range(first, first + int(model.body_jntnum[link])):
            if joint in columns:
                home = float(model.qpos0[model.jnt_qposadr[joint]])
                _move(model, joint, end, columns[joint], q[:, columns[joint]] - home)
    if is_site:
        here = np.concatenate([model.site_pos[index], model.site_quat[index]])
        end.pose = seen_from(end.pose, here)
    return end


def _move(model: mujoco.MjModel, joint: int, end: _End, column: int, by: Float64) -> None:
    """Move a link by its joint: float64[T] (rad, m)."""
    pose = end.pose
    own: Float64 = model.jnt_axis[joint]
    axis = rotated(pose[:, 3:], own)
    anchor = pose[:, :3] + rotated(pose[:, 3:], model.jnt_pos[joint])
    is_slide = int(model.jnt_type[joint]) == int(mujoco.mjtJoint.mjJNT_SLIDE)
    end.joints[column] = _Joint(anchor, axis, is_slide)
    if is_slide:
        end.pose = np.concatenate([pose[:, :3] + by[:, None] * axis, pose[:, 3:]], axis=1)
        return
    turned = product(pose[:, 3:], turn(by[:, None] * own))
    at = anchor - rotated(turned, model.jnt_pos[joint])
    end.pose = np.concatenate([at, turned], axis=1)
