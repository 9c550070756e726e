"""What a controller of poses does whose kinematics are of another posture than the arm's."""

import numpy as np

from shared.sim.arm import Float64
from shared.sim.plant.kinematics import tool_jacobians, tool_poses
from shared.sim.plant.poses import conjugate, product, rotation_vectors, turn
from shared.sim.plant.row import Row
from shared.sim.plant.signals import Signal, sampled

_NEAR = 0.02
"""Either side of an instant that a velocity is taken over (s)."""
_FIRM = 1e-6
"""Keeps a wrench finite where the arm is singular (m^2/(kg m^2))."""


def as_if_at(row: Row, target: Signal, believed: Signal, true: Signal) -> Signal:
    """Return the target with which a servo at the true tool does what one at the believed would.

    The controller takes pose, velocity and Jacobian of the tool from a believed posture, and turns
    a wrench w into joint torques J_b'w. The simulated servo has the true posture, so its target is
    where its own wrench makes the same torques, as well as a wrench can (least squares of the
    accelerations). Posture and velocity are those of the recording, not of the replay, and cycles
    in which torques are limited are not told from others.

    Args:
        row: the arm.
        target: float64[C, 7] poses that the controller compares with.
        believed: float64[T, J], the logged joints as the controller sees them (rad, m).
        true: float64[T, J], the same as they are.
    """
    plant, model = row.plant, row.model
    at: Float64 = plant.timestep * np.arange(
        int(np.ceil(row.duration / plant.timestep)) + 2, dtype=np.float64
    )
    seen, seen_speed, seen_jacobian = _tool(row, believed, at)
    tool, speed, jacobian = _tool(row, true, at)
    stiffness, damping = _gains(row)
    out = target.held(at)
    error = np.concatenate(
        [
            out[:, :3] - seen[:, :3],
            rotation_vectors(product(out[:, 3:], conjugate(seen[:, 3:]))),
        ],
        axis=1,
    )
    dofs = [int(model.joint(name).dofadr[0]) for name in plant.joints]
    weighed: Float64 = jacobian / model.dof_M0[dofs]  # accelerations count, not torques
    square = weighed @ jacobian.transpose(0, 2, 1) + _FIRM * np.eye(6)
    carried = weighed @ seen_jacobian.transpose(0, 2, 1) + _FIRM * np.eye(6)
    asked = stiffness * error - damping * seen_speed
    wrench = np.linalg.solve(square, carried @ asked[:, :, None])[:, :, 0]
    way = (wrench + damping * speed) / stiffness
    out[:, :3] = tool[:, :3] + way[:, :3]
    out[:, 3:] = product(turn(way[:, 3:]), tool[:, 3:])
    return Signal(at, out)


def _tool(row: Row, joints: Signal, at: Float64) -> tuple[Float64, Float64, Float64]:
    """Return the tool's pose float64[T, 7], velocity float64[T, 6] and Jacobian."""
    q = sampled(joints.at, joints.values, at)
    ahead = sampled(joints.at, joints.values, at + _NEAR)
    behind = sampled(joints.at, joints.values, at - _NEAR)
    jacobian = tool_jacobians(row.plant, row.model, q)
    speed = jacobian @ ((ahead - behind) / (2.0 * _NEAR))[:, :, None]
    return tool_poses(row.plant, row.model, q), speed[:, :, 0], jacobian


def _gains(row: Row) -> tuple[Float64, Float64]:
    """Return stiffness and damping of the servo: float64[6] each (N/m, N m/rad; times s)."""
    gain, bias = row.current("actuator_gainprm"), row.current("actuator_biasprm")
    x, y, z, turning = (int(row.model.actuator(name).id) for name in row.plant.actuators)
    order = [x, y, z, turning, turning, turning]
    return gain[order, 0], -bias[order, 2]
