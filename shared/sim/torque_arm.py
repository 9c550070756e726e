"""One arm with its bat, driven by joint torques a thousand times a second, as on the robot.

What ``build.py`` gives the learner is servos; here they are taken out, and whoever drives the arm
computes the torques. The cubic damping goes with them where the torques pass the robot's own
limiter (``TorqueLimiter``), for that is what it stands for.
"""

from typing import Final

import msgspec
import mujoco
import numpy as np

from shared.sim.arm import Arm, Float64, load_arm
from shared.sim.build import AGENTS, build_spec
from shared.sim.config import SimConfig
from shared.sim.model import FencingModel
from shared.sim.parameters import ModelParameters
from shared.sim.servo import CYCLE

JOINTS: Final = 7
COAST_FRICTION: Final = 0.25
"""Of every joint without power (N m): about what a motor needs to turn without a load, 4 mN m,
times the reduction, 33 to 63."""
_SLOW: Final = 0.05
"""Friction is in full from here on (rad/s)."""
_AGENT: Final = AGENTS[1]


class TorqueArm:
    """The protagonist's arm, at rest en garde; nothing else is in its world.

    A cycle is :meth:`sense`, then :meth:`drive`.
    """

    def __init__(self, cfg: SimConfig, parameters: ModelParameters) -> None:
        """Build it.

        Args:
            cfg: the scene, of which the protagonist's side counts; its time steps do not.
            parameters: the simulator's parameters, of which the servo's do not count.
        """
        cfg = msgspec.structs.replace(cfg, physics_timestep=CYCLE)
        self.arm: Arm = load_arm(cfg.arms[1])
        spec = build_spec(cfg, parameters, (_AGENT,))
        for actuator in list(spec.actuators):
            spec.delete(actuator)
        self._cubic = np.zeros(JOINTS)
        for index, joint in enumerate(self.arm.joints):
            damping = spec.joint(f"{_AGENT}/{joint.name}").damping
            self._cubic[index], damping[2] = damping[2], 0.0
        self._mj = spec.compile()
        self._data = mujoco.MjData(self._mj)
        torso = self._mj.site(f"{_AGENT}/torso").id
        self._tool = self._mj.site(f"{_AGENT}/tool").id
        self._en_garde = FencingModel.of(cfg, parameters).en_garde[1]
        self._data.qpos[:] = self._en_garde
        mujoco.mj_forward(self._mj, self._data)
        self._torso_in_world: Float64 = self._data.site_xpos[torso].copy()
        self._world_from_torso: Float64 = self._data.site_xmat[torso].reshape(3, 3).copy()
        self._jacobian = np.zeros((2, 3, JOINTS))
        self.q: Float64 = self._data.qpos
        """float64[7], positions from the shoulder to the wrist (rad); a view."""
        self.qd: Float64 = self._data.qvel
        """float64[7] (rad/s); a view."""
        self.position = np.zeros(3)
        """float64[3] of the tool in the torso frame (m)."""
        self.rotation = np.eye(3)
        """float64[3, 3], axes of the tool in the torso frame."""
        self.jacobian = np.zeros((6, JOINTS))
        """float64[6, 7]: linear, then angular velocity of the tool in the torso frame."""
        self.is_blocked = False
        """Whether something holds the joints where they are, whatever torque there is."""
        self.sense()

    def put_back(self) -> None:
        """Put it at rest en garde, as a person does by hand."""
        self._data.qpos[:] = self._en_garde
        self._data.qvel[:] = 0.0
        self.sense()

    def sense(self) -> None:
        """Bring position, rotation and Jacobian up to the joints."""
        mujoco.mj_step1(self._mj, self._data)
        mujoco.mj_jacSite(self._mj, self._data, self._jacobian[0], self._jacobian[1], self._tool)
        back = self._world_from_torso.T
        self.position = back @ (self._data.site_xpos[self._tool] - self._torso_in_world)
        self.rotation = back @ self._data.site_xmat[self._tool].reshape(3, 3)
        self.jacobian = (back @ self._jacobian).reshape(6, JOINTS)

    def drive(self, torques: Float64) -> None:
        """Let torques act for one cycle: float64[7], finite (N m)."""
        if self.is_blocked:
            self._data.qvel[:] = 0.0
            self._data.time += CYCLE
            return
        self._data.qfrc_applied[:] = torques
        mujoco.mj_step2(self._mj, self._data)

    def coast(self) -> None:
        """Go on for one cycle with motors that have no power.

        How a PR2's joints coast was never measured. They brake as the model's do, cubic part
        included, and by the motors' own friction; that of the gears comes on top, unknown.
        """
        friction = COAST_FRICTION * np.tanh(self.qd / _SLOW)
        self.drive(-self._cubic * self.qd**3 - friction)

    def push(self, force: Float64) -> None:
        """Pull at the tool from now on: float64[3] in the torso frame (N); zeros let go."""
        body = self._mj.site_bodyid[self._tool]
        world = self._world_from_torso @ force
        lever = self._data.site_xpos[self._tool] - self._data.xipos[body]
        self._data.xfrc_applied[body, :3] = world
        self._data.xfrc_applied[body, 3:] = np.cross(lever, world)


class TorqueLimiter:
    """The robot's own limiter of every joint's torque; nothing can switch it off.

    Source: pr2_mechanism_model, joint.cpp:88-122: near a soft limit the velocity towards it is
    bounded in proportion to the distance, and near that bound the torque to the excess.
    """

    def __init__(self, arm: Arm) -> None:
        joints = arm.joints
        far = (-np.inf, np.inf)
        self.effort = np.array([joint.effort_limit for joint in joints])
        """float64[7], what no torque exceeds (N m)."""
        self._velocity = np.array([joint.velocity_limit for joint in joints])
        self._k_position = np.array([joint.safety_gains[0] or 1.0 for joint in joints])
        self._k_velocity = np.array([joint.safety_gains[1] for joint in joints])
        self._lower, self._upper = np.array([joint.range or far for joint in joints]).T

    def limits(self, q: Float64, qd: Float64) -> tuple[Float64, Float64]:
        """Return the lowest and the highest torque that gets through: float64[7] each (N m).

        Args:
            q: float64[7] (rad).
            qd: float64[7] (rad/s).
        """
        fast, strong = self._velocity, self.effort
        fastest = _within(self._k_position * (self._upper - q), fast)
        slowest = _within(self._k_position * (self._lower - q), fast)
        return (
            _within(self._k_velocity * (slowest - qd), strong),
            _within(self._k_velocity * (fastest - qd), strong),
        )

    def limit(self, torques: Float64, q: Float64, qd: Float64) -> Float64:
        """Return what gets through of torques; what is not a number does, as on the robot."""
        low, high = self.limits(q, qd)
        return np.minimum(np.maximum(torques, low), high)


def _within(values: Float64, most: Float64) -> Float64:
    """Return values between minus and plus ``most``; np.clip takes three times as long."""
    return np.minimum(np.maximum(values, -most), most)
