"""Where the tool is at many postures at once, by the kinematics of the model."""

from dataclasses import dataclass

import mujoco
import numpy as np

from shared.sim.arm import Float64
from shared.sim.plant.plant import TOOL, Plant
from shared.sim.plant.poses import conjugate, cross, inverse, product, rotated, seen_from

_XBODY = int(mujoco.mjtObj.mjOBJ_XBODY)
_HINGE = int(mujoco.mjtJoint.mjJNT_HINGE)
_PARALLEL = 0.999
"""Cosine of the angle between lines that are taken to be parallel."""


def tool_poses(plant: Plant, model: mujoco.MjModel, q: Float64) -> Float64:
    """Return float64[T, 7]: what a tracker without error would say.

    Joints that are not logged stand where the model has them.

    Args:
        plant: the arm.
        model: of it, compiled; its nominal numbers.
        q: float64[T, J], logged joints (rad, m).
    """
    at = _moved(plant, model, q)
    return at.tool if at.base is None else seen_from(inverse(at.base), at.tool)


def tool_motion(plant: Plant, model: mujoco.MjModel, q: Float64) -> tuple[Float64, Float64]:
    """Return :func:`tool_poses` and their Jacobian, of the same arguments.

    The Jacobian, float64[T, 6, J], makes velocity and angular velocity of the joints' velocities,
    in the frame of the poses, which no logged joint moves.
    """
    at = _moved(plant, model, q)
    slides = model.jnt_type[at.joints] == int(mujoco.mjtJoint.mjJNT_SLIDE)
    lever = at.tool[:, None, :3] - at.anchors
    turning = np.where(slides[:, None], 0.0, at.axes)
    moving = np.where(slides[:, None], at.axes, cross(at.axes, lever))
    is_above = np.array([_carries(model, int(model.jnt_bodyid[one]), at.body) for one in at.joints])
    jacobian = np.concatenate([moving, turning], axis=2) * is_above[:, None]
    if at.base is None:
        return at.tool, jacobian.swapaxes(1, 2)
    back = conjugate(at.base[:, None, 3:])
    parts = [rotated(back, jacobian[:, :, part]) for part in (slice(0, 3), slice(3, 6))]
    seen = seen_from(inverse(at.base), at.tool)
    return seen, np.concatenate(parts, axis=2).swapaxes(1, 2)


def turned_axes(model: mujoco.MjModel, body: int) -> list[bool]:
    """Return for x, y and z of a body whether a hinge that moves it turns about another line."""
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    hinges = [
        joint
        for joint in range(model.njnt)
        if model.jnt_type[joint] == _HINGE and _carries(model, int(model.jnt_bodyid[joint]), body)
    ]
    along = np.abs(data.xaxis[hinges] @ data.xmat[body].reshape(3, 3))
    return [bool(each) for each in (along < _PARALLEL).any(axis=0)]


@dataclass(frozen=True)
class _At:
    """An arm at each posture, in the world."""

    tool: Float64
    """float64[T, 7]."""
    base: Float64 | None
    """float64[T, 7], what the tool's pose is measured from; None is the world."""
    joints: np.ndarray
    """int[J], the logged ones in the model."""
    anchors: Float64
    """float64[T, J, 3], of the logged joints (m)."""
    axes: Float64
    """float64[T, J, 3]."""
    body: int
    """That the tool is fixed to."""


def _moved(plant: Plant, model: mujoco.MjModel, q: Float64) -> _At:
    joints = np.array([int(model.joint(name).id) for name in plant.joints])
    places = model.jnt_qposadr[joints]
    sensor = int(model.sensor(f"{TOOL}/position").id)
    tool = _Fixed.of(model, int(model.sensor_objtype[sensor]), int(model.sensor_objid[sensor]))
    base = None
    if model.sensor_refid[sensor] >= 0:
        kind, index = int(model.sensor_reftype[sensor]), int(model.sensor_refid[sensor])
        base = _Fixed.of(model, kind, index)
    bodies = [tool.body] if base is None else [tool.body, base.body]
    data = mujoco.MjData(model)
    postures = np.tile(data.qpos, (len(q), 1))
    postures[:, places] = q
    seen = (data.xpos, data.xquat, data.xanchor, data.xaxis)
    kept = [np.empty((len(q), *each.shape)) for each in seen]
    qpos = data.qpos
    for row, posture in enumerate(postures):
        qpos[:] = posture
        mujoco.mj_kinematics(model, data)
        for array, now in zip(kept, seen, strict=True):
            array[row] = now
    frames = np.concatenate([kept[0][:, bodies], kept[1][:, bodies]], axis=2)
    return _At(
        tool=tool.seen(frames[:, 0]),
        base=None if base is None else base.seen(frames[:, 1]),
        joints=joints,
        anchors=kept[2][:, joints],
        axes=kept[3][:, joints],
        body=tool.body,
    )


@dataclass(frozen=True)
class _Fixed:
    """A frame that is fixed to a body."""

    body: int
    at: Float64
    """float64[7] in the body's frame."""

    @staticmethod
    def of(model: mujoco.MjModel, kind: int, index: int) -> "_Fixed":
        if kind == _XBODY:
            return _Fixed(index, np.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]))
        at = np.concatenate([model.site_pos[index], model.site_quat[index]])
        return _Fixed(int(model.site_bodyid[index]), at)

    def seen(self, frames: Float64) -> Float64:
        """Return float64[T, 7] of the body's frames."""
        turned = product(frames[:, 3:], self.at[3:])
        return np.concatenate([frames[:, :3] + rotated(frames[:, 3:], self.at[:3]), turned], axis=1)


def _carries(model: mujoco.MjModel, body: int, other: int) -> bool:
    """Return whether a body moves with another."""
    while other and other != body:
        other = int(model.body_parentid[other])
    return other == body
