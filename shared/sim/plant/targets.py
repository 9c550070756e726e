"""What a controller of poses does whose kinematics are of another posture than the arm's."""

import functools

import mujoco
import numpy as np

from shared.sim.arm import Float64
from shared.sim.plant.kinematics import tool_motion
from shared.sim.plant.plant import Plant
from shared.sim.plant.poses import conjugate, product, rotation_vectors, turn
from shared.sim.plant.row import Row
from shared.sim.plant.signals import Signal, sampled

_PERIOD = 0.01
"""Of the instants at which kinematics are taken (s)."""
_NEAR = 0.02
"""Either side of an instant that a velocity is taken over (s)."""
_KEPT = 512
"""Recordings, or parts of them, of which kinematics are kept: 50 kB each."""
_FIRM = 1e-6
"""Keeps a wrench finite where the arm is singular (m^2/(kg m^2))."""


def as_if_at(row: Row, target: Signal, believed: Signal, true: Signal) -> Signal:
    """Return the target with which a servo at the true tool does what one at the believed would.

    The controller takes pose, velocity and Jacobian of the tool from a believed posture, and turns
    a wrench w into joint torques J_b'w. The simulated servo has the true posture, so its target is
    where its own wrench makes the same torques, as well as a wrench can (least squares of the
    accelerations); what it cannot, of seven joints, is fed to them. Posture and velocity are those
    of the recording, not of the replay.

    Args:
        row: the arm.
        target: float64[C, 7] poses that the controller compares with.
        believed: float64[T, J], the logged joints as the controller sees them (rad, m).
        true: float64[T, J], the same as they are; give the same object for the same joints.
    """
    at = _instants(row.duration)
    seen, seen_jacobian, seen_speed = _tool(row.plant, row.model, believed, row.duration)
    tool, jacobian, speed = _tool(row.plant, row.model, true, row.duration)
    stiffness, damping = _gains(row)
    given = _mean(target, at)
    asked = stiffness * _way(seen, given) - damping * seen_speed
    dofs = [int(row.model.joint(name).dofadr[0]) for name in row.plant.joints]
    weighed: Float64 = jacobian / row.model.dof_M0[dofs]  # accelerations count, not torques
    square = weighed @ jacobian.transpose(0, 2, 1) + _FIRM * np.eye(6)
    carried = weighed @ seen_jacobian.transpose(0, 2, 1) + _FIRM * np.eye(6)
    wrench = np.linalg.solve(square, carried @ asked[:, :, None])[:, :, 0]
    left = np.einsum("tij,ti->tj", seen_jacobian, asked) - np.einsum("tij,ti->tj", jacobian, wrench)
    row.feed(Signal(at - 0.5 * _PERIOD, left))
    shift = _way(given, _moved(tool, (wrench + damping * speed) / stiffness))
    steps: Float64 = np.arange(0.0, row.duration + row.plant.timestep, row.plant.timestep)
    # Commands count from half a step before (see Rollouts); the shift is of the posture now.
    before: Float64 = steps - 0.5 * row.plant.timestep
    held = target.mean(before, row.plant.timestep)
    return Signal(before, _moved(held, sampled(at, shift, steps)))


def _mean(target: Signal, at: Float64) -> Float64:
    """Return float64[T, 7]: targets on average around instants, as commands go in steps."""
    offsets = _PERIOD * np.array([-0.4, -0.2, 0.0, 0.2, 0.4])
    poses = target.held((at[:, None] + offsets).ravel()).reshape(len(at), len(offsets), 7)
    signs = np.where(np.einsum("toi,ti->to", poses[:, :, 3:], poses[:, 0, 3:]) < 0.0, -1.0, 1.0)
    poses[:, :, 3:] *= signs[:, :, None]
    out = poses.mean(axis=1)
    out[:, 3:] /= np.linalg.norm(out[:, 3:], axis=1, keepdims=True)
    return out


def _way(start: Float64, end: Float64) -> Float64:
    """Return float64[T, 6], the way (m) and the rotation vector (rad) between poses."""
    turning = rotation_vectors(product(end[:, 3:], conjugate(start[:, 3:])))
    return np.concatenate([end[:, :3] - start[:, :3], turning], axis=1)


def _moved(start: Float64, way: Float64) -> Float64:
    """Return float64[T, 7]: the other way round."""
    turned = product(turn(way[:, 3:]), start[:, 3:])
    return np.concatenate([start[:, :3] + way[:, :3], turned], axis=1)


def _instants(until: float) -> Float64:
    """Return float64[T], at which kinematics are taken (s)."""
    return np.arange(0.0, until + 2.0 * _PERIOD, _PERIOD, dtype=np.float64)


@functools.lru_cache(_KEPT)
def _tool(
    plant: Plant, model: mujoco.MjModel, joints: Signal, until: float
) -> tuple[Float64, Float64, Float64]:
    """Return the tool's pose float64[T, 7], Jacobian and velocity float64[T, 6].

    Kept, since variants that differ in something else ask for the same.
    """
    at = _instants(until)
    q = sampled(joints.at, joints.values, at)
    ahead = sampled(joints.at, joints.values, at + _NEAR)
    behind = sampled(joints.at, joints.values, at - _NEAR)
    pose, jacobian = tool_motion(plant, model, q)
    speed = np.einsum("tij,tj->ti", jacobian, (ahead - behind) / (2.0 * _NEAR))
    return pose, jacobian, speed


def _gains(row: Row) -> tuple[Float64, Float64]:
    """Return stiffness and damping of the servo: float64[6] each (N/m, N m/rad; times s)."""
    gain, bias = row.current("actuator_gainprm"), row.current("actuator_biasprm")
    x, y, z, turning = (int(row.model.actuator(name).id) for name in row.plant.actuators)
    order = [x, y, z, turning, turning, turning]
    return gain[order, 0], -bias[order, 2]
