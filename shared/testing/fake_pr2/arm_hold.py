"""The controller a PR2's arm has after it was started, as far as it matters: it holds.

robot_mechanism_controllers/JointTrajectoryActionController runs a PID per joint along a
trajectory; nobody sends one here, so it stays where it was started. Its gains are those of
pr2_arm_controllers.yaml, many times stiffer than the Cartesian controller.
"""

from collections.abc import Mapping
from typing import Any, Final

import msgspec
import numpy as np

from shared.sim.arm import Float64
from shared.sim.servo import CYCLE
from shared.sim.torque_arm import JOINTS, TorqueArm

TYPE: Final = "robot_mechanism_controllers/JointTrajectoryActionController"


class PidGains(msgspec.Struct, frozen=True):
    """Of one joint (N m/rad, N m/(rad s), N m s/rad; N m)."""

    p: float
    i: float
    d: float
    i_clamp: float


SHIPPED: Final = (
    PidGains(2400.0, 800.0, 18.0, 4.0),
    PidGains(1200.0, 700.0, 10.0, 4.0),
    PidGains(1000.0, 600.0, 6.0, 4.0),
    PidGains(700.0, 450.0, 4.0, 4.0),
    PidGains(300.0, 300.0, 6.0, 2.0),
    PidGains(300.0, 300.0, 4.0, 2.0),
    PidGains(300.0, 300.0, 4.0, 2.0),
)
"""From the shoulder to the wrist."""


class ArmHold:
    """Holds the joints where they were when it was started."""

    type = TYPE

    def __init__(self, gains: tuple[PidGains, ...]) -> None:
        self.is_running = False
        self._p, self._i, self._d, self._clamp = np.array(
            [[gain.p, gain.i, gain.d, gain.i_clamp] for gain in gains]
        ).T
        self._aim = np.zeros(JOINTS)
        self._integral = np.zeros(JOINTS)

    def start(self, arm: TorqueArm, now: float) -> None:
        """Hold where the arm is now."""
        del now
        self._aim = arm.q.copy()
        self._integral = np.zeros(JOINTS)

    def update(self, arm: TorqueArm, now: float) -> Float64:
        """Return the torques of this cycle: float64[7] (N m)."""
        del now
        away = self._aim - arm.q
        self._integral = np.clip(self._integral + self._i * away * CYCLE, -self._clamp, self._clamp)
        return self._p * away + self._integral - self._d * arm.qd


def read_gains(found: Mapping[str, Any], joints: tuple[str, ...]) -> tuple[PidGains, ...] | None:
    """Return the gains in a controller's namespace, or None where something is missing."""
    try:
        by_joint = msgspec.convert(found.get("gains"), dict[str, PidGains], strict=False)
        return tuple(by_joint[joint] for joint in joints)
    except (msgspec.ValidationError, KeyError):
        return None
