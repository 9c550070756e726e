"""The law of robot_mechanism_controllers/JTCartesianController, one 1 kHz cycle at a time.

Restated from what the controller computes (pr2_controllers, jt_cartesian_controller.cpp): filter
the command, turn the pose error into a velocity, shorten that, turn what is missing of it into a
force, and the force into torques by the transposed Jacobian. With its habits: it believes any
position, numbers or not; it keeps its last command for ever; starting it anew forgets that.
"""

import math
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

import msgspec
import numpy as np

from shared.sim.arm import Float64
from shared.sim.torque_arm import JOINTS, TorqueArm

TYPE: Final = "robot_mechanism_controllers/JTCartesianController"
IGNORED_JOINT: Final = 9999.0
"""A posture's joint that may be anywhere."""
QUEUED: Final = 256
"""Commands on their way at a time; a real sender keeps one, so this is never reached."""


class Trans(msgspec.Struct, frozen=True):
    """Gains of one kind."""

    p: float
    d: float


class CartGains(msgspec.Struct, frozen=True):
    """Gains of both kinds (N/m and N s/m; N m/rad and N m s/rad)."""

    trans: Trans
    rot: Trans


class JtParameters(msgspec.Struct, frozen=True):
    """What the controller reads from its namespace when it is loaded; its own defaults."""

    root_name: str
    tip_name: str
    cart_gains: CartGains
    pose_command_filter: float = 1.0
    vel_saturation_trans: float = 0.0
    vel_saturation_rot: float = 0.0
    jacobian_inverse_damping: float = 0.0
    joint_vel_filter: float = 1.0
    k_posture: float = 1.0
    joint_feedforward: dict[str, float] = {}
    saturation: dict[str, float] = {}
    """Largest torque by joint (N m). Nothing sets this on a stock robot: what its launch file
    sets, ``joint_max_effort``, is not read."""


@dataclass(frozen=True)
class JtState:
    """What the controller publishes every tenth cycle."""

    x: Float64
    """float64[7]: position (m) and quaternion (w, x, y, z) of the tool; so are the next two."""
    x_desi: Float64
    x_desi_filtered: Float64
    x_err: Float64
    """float64[6], linear first; so are the next three (m/s and rad/s; N and N m)."""
    xd: Float64
    xd_desi: Float64
    force: Float64
    tau_pose: Float64
    """float64[7] (N m); so are the next two."""
    tau_posture: Float64
    tau: Float64
    jacobian: Float64
    """float64[6, 7]."""
    nullspace: Float64
    """float64[7, 7]."""


class JtCartesian:
    """One controller; whoever runs it calls ``update`` once a cycle."""

    type = TYPE
    publish_every = 10
    """Cycles."""

    def __init__(self, parameters: JtParameters, joints: tuple[str, ...], delay: float) -> None:
        """Take the parameters.

        Args:
            parameters: as read when it was loaded.
            joints: names of the arm's joints, from the shoulder.
            delay: from a command's arrival to its effect (s).
        """
        gains = parameters.cart_gains
        self.parameters = parameters
        self.is_running = False
        self.kp = np.repeat([gains.trans.p, gains.rot.p], 3)
        self.kd = np.repeat([gains.trans.d, gains.rot.d], 3)
        self._delay = delay
        self._feedforward = _by_joint(parameters.joint_feedforward, joints)
        self._saturation = _by_joint(parameters.saturation, joints)
        self._is_saturated = bool((self._saturation > 0.0).any())
        self._commands: deque[tuple[float, Float64]] = deque(maxlen=QUEUED)
        self._desired = self._filtered = np.zeros(7)
        self._posture = np.zeros(JOINTS)
        self._uses_posture = False
        self._velocity = np.zeros(JOINTS)
        self._cycles = 0
        self.force = np.zeros(6)
        """float64[6] of the last cycle, linear first (N, N m)."""
        self.state: JtState | None = None
        """Of the last cycle that published."""

    def start(self, arm: TorqueArm, now: float) -> None:
        """Hold where the arm is now, whatever has arrived; what is on its way still counts."""
        self._desired = self._filtered = pose_of(arm)
        self._posture = arm.q.copy()
        self._velocity = np.zeros(JOINTS)
        while self._commands and self._commands[0][0] <= now:
            self._commands.popleft()
        self._cycles = 0

    def command(self, pose: Float64, now: float) -> None:
        """Take a command: float64[7], position and unit quaternion; any position is believed."""
        self._commands.append((now + self._delay, pose))

    def command_posture(self, posture: Float64) -> None:
        """Take a posture: float64[7] (rad), or nothing to have none; another size is refused."""
        if posture.size == JOINTS:
            self._posture = posture.copy()
        self._uses_posture = bool(posture.size == JOINTS or (posture.size and self._uses_posture))

    def set_gains(self, gains: Float64) -> None:
        """Take new gains at once, whatever they are: float64[6] Kp, or [12] with Kd."""
        if gains.size >= 6:
            self.kp = gains[:6].copy()
        if gains.size == 12:
            self.kd = gains[6:].copy()

    def update(self, arm: TorqueArm, now: float) -> Float64:
        """Return the torques of this cycle: float64[7] (N m)."""
        cfg = self.parameters
        self._cycles += 1
        while self._commands and self._commands[0][0] <= now:
            self._desired = self._commands.popleft()[1]
        self._filtered = filtered(self._filtered, self._desired, cfg.pose_command_filter)
        self._velocity = self._velocity + cfg.joint_vel_filter * (arm.qd - self._velocity)
        jacobian = arm.jacobian
        moving = jacobian @ self._velocity
        error = pose_error(arm.position, arm.rotation, self._filtered)
        wanted = -self.kp / self.kd * error
        wanted[:3] = _shortened(wanted[:3], cfg.vel_saturation_trans)
        wanted[3:] = _shortened(wanted[3:], cfg.vel_saturation_rot)
        self.force = force = self.kd * (wanted - moving)
        tau_pose = jacobian.T @ force
        tau_posture = np.zeros(JOINTS)
        is_shown = self._cycles % self.publish_every == 0
        nullspace = np.zeros((JOINTS, JOINTS))
        if is_shown or self._uses_posture:
            nullspace = _nullspace(jacobian, cfg.jacobian_inverse_damping)
        if self._uses_posture:
            away = self._posture_error(arm)
            tau_posture = self._feedforward * (nullspace @ (cfg.k_posture * away))
        tau = tau_pose + tau_posture
        if is_shown:
            self.state = JtState(
                x=pose_of(arm), x_desi=self._desired, x_desi_filtered=self._filtered, x_err=error,
                xd=moving, xd_desi=wanted, force=force, tau_pose=tau_pose,
                tau_posture=tau_posture, tau=tau, jacobian=jacobian, nullspace=nullspace,
            )  # fmt: skip
        return self._scale(tau) * tau

    @property
    def is_due(self) -> bool:
        """Return whether the last cycle was one to publish."""
        return self._cycles > 0 and self._cycles % self.publish_every == 0

    def _posture_error(self, arm: TorqueArm) -> Float64:
        away = self._posture - arm.q
        for index, joint in enumerate(arm.arm.joints):
            if joint.range is None:
                away[index] = np.remainder(away[index] + np.pi, 2.0 * np.pi) - np.pi
        return np.where(np.abs(self._posture - IGNORED_JOINT) < 1e-5, 0.0, away)

    def _scale(self, tau: Float64) -> float:
        """Return what all torques are multiplied by, so that none is over its saturation."""
        if not self._is_saturated:
            return 1.0
        scale = 1.0
        for most, torque in zip(self._saturation.tolist(), tau.tolist(), strict=True):
            if most > 0.0 and abs(torque) > most:  # never true for NaN, which stays NaN
                scale = min(scale, most / abs(torque))
        return scale


def pose_of(arm: TorqueArm) -> Float64:
    """Return float64[7], where the tool is."""
    return np.concatenate([arm.position, quaternion_of(arm.rotation)])


def pose_error(position: Float64, rotation: Float64, desired: Float64) -> Float64:
    """Return float64[6], where a pose is as seen from the desired one (m, rad for small turns)."""
    aim = rotation_of(desired[3:])
    # Half the sum of the axes' cross products, desired first.
    (_, ab, ac), (ba, _, bc), (ca, cb, _) = (aim @ rotation.T).tolist()
    x, y, z = (position - desired[:3]).tolist()
    return np.array([x, y, z, 0.5 * (bc - cb), 0.5 * (ca - ac), 0.5 * (ab - ba)])


def filtered(start: Float64, end: Float64, share: float) -> Float64:
    """Return a pose a share of the way on: straight, and on the great arc; NaN stays NaN."""
    out = start + share * (end - start)
    first, second = start[3:], end[3:]
    cosine = float(first @ second)
    if cosine < 0.0:
        second, cosine = -second, -cosine
    angle = math.atan2(_length(second - cosine * first), cosine)
    if angle != 0.0:  # true for NaN
        between = math.sin((1.0 - share) * angle) * first + math.sin(share * angle) * second
        out[3:] = between / _length(between)
    else:
        out[3:] = first
    return out


def rotation_of(quaternion: Float64) -> Float64:
    """Return float64[3, 3] of a unit quaternion (w, x, y, z)."""
    w, x, y, z = quaternion.tolist()
    return np.array(
        [
            [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)],
            [2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w)],
            [2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)],
        ]
    )


def quaternion_of(rotation: Float64) -> Float64:
    """Return the unit quaternion (w, x, y, z) of float64[3, 3], w not negative."""
    (a, b, c), (d, e, f), (g, h, i) = rotation.tolist()
    # Four times the products of its components; the row of the largest square is well conditioned.
    four = np.array(
        [
            [1.0 + a + e + i, h - f, c - g, d - b],
            [h - f, 1.0 + a - e - i, b + d, c + g],
            [c - g, b + d, 1.0 - a + e - i, f + h],
            [d - b, c + g, f + h, 1.0 - a - e + i],
        ]
    )
    row = four[int(np.argmax(np.diag(four)))]
    row = row / np.linalg.norm(row)
    return -row if row[0] < 0.0 else row


def read_parameters(found: Mapping[str, Any]) -> JtParameters | None:
    """Return what is in a controller's namespace, or None where something needed is missing."""
    try:
        return msgspec.convert(dict(found), JtParameters, strict=False)
    except msgspec.ValidationError:
        return None


def _by_joint(values: Mapping[str, float], joints: tuple[str, ...]) -> Float64:
    return np.array([values.get(joint, 0.0) for joint in joints])


def _shortened(velocity: Float64, most: float) -> Float64:
    size = _length(velocity)
    return velocity * (most / size) if most > 0.0 and size > most else velocity


def _length(vector: Float64) -> float:
    return math.sqrt(float(vector @ vector))


def _nullspace(jacobian: Float64, damping: float) -> Float64:
    square = jacobian @ jacobian.T + damping * np.eye(6)
    return np.eye(JOINTS) - jacobian.T @ np.linalg.solve(square, jacobian)
