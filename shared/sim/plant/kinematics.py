"""Where the tool is at many postures at once, by the kinematics of the model."""

import mujoco
import numpy as np

from shared.sim.arm import Float64
from shared.sim.plant.plant import TOOL, Plant
from shared.sim.plant.poses import inverse, product, rotated, seen_from, turn

_HOME = np.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0])


def tool_poses(plant: Plant, model: mujoco.MjModel, q: Float64) -> Float64:
    """Return float64[T, 7]: what a tracker without error would say.

    Joints that are not logged stand where the model has them.

    Args:
        plant: the arm.
        model: of it, compiled; its nominal numbers.
        q: float64[T, J], logged joints (rad, m).
    """
    sensor = int(model.sensor(f"{TOOL}/position").id)
    columns = {int(model.joint(name).id): index for index, name in enumerate(plant.joints)}
    tool = _pose(
        model, int(model.sensor_objtype[sensor]), int(model.sensor_objid[sensor]), columns, q
    )
    if model.sensor_refid[sensor] < 0:
        return tool
    base = _pose(
        model, int(model.sensor_reftype[sensor]), int(model.sensor_refid[sensor]), columns, q
    )
    return seen_from(inverse(base), tool)


def _pose(
    model: mujoco.MjModel, kind: int, index: int, columns: dict[int, int], q: Float64
) -> Float64:
    """Return float64[T, 7], a site or a body in the world."""
    is_site = kind == int(mujoco.mjtObj.mjOBJ_SITE)
    body = int(model.site_bodyid[index]) if is_site else index
    chain: list[int] = []
    while body:
        chain.append(body)
        body = int(model.body_parentid[body])
    pose = np.tile(_HOME, (len(q), 1))
    for link in reversed(chain):
        pose = seen_from(pose, np.concatenate([model.body_pos[link], model.body_quat[link]]))
        first = int(model.body_jntadr[link])
        for joint in range(first, first + int(model.body_jntnum[link])):
            if joint in columns:
                home = float(model.qpos0[model.jnt_qposadr[joint]])
                pose = _moved(model, joint, pose, q[:, columns[joint]] - home)
    if is_site:
        pose = seen_from(pose, np.concatenate([model.site_pos[index], model.site_quat[index]]))
    return pose


def _moved(model: mujoco.MjModel, joint: int, pose: Float64, by: Float64) -> Float64:
    """Return float64[T, 7], a link's pose after its joint has moved by float64[T] (rad, m)."""
    axis: Float64 = model.jnt_axis[joint]
    if int(model.jnt_type[joint]) == int(mujoco.mjtJoint.mjJNT_SLIDE):
        at = pose[:, :3] + rotated(pose[:, 3:], by[:, None] * axis)
        return np.concatenate([at, pose[:, 3:]], axis=1)
    anchor = pose[:, :3] + rotated(pose[:, 3:], model.jnt_pos[joint])
    turned = product(pose[:, 3:], turn(by[:, None] * axis))
    return np.concatenate([anchor - rotated(turned, model.jnt_pos[joint]), turned], axis=1)
