"""The 1 kHz loop: an arm, the controllers that run on it, and what becomes of their torques.

As pr2_controller_manager and pr2_ethercat do it: the torques of all running controllers add up,
pass each joint's limiter, and reach the motors unless those are halted; starting a controller
that runs makes it begin anew; when the motors come back, every running controller is restarted.
Not thread-safe: one owner, who calls ``cycle`` a thousand times a simulated second.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Final, Protocol

import numpy as np

from shared.sim.arm import Float64
from shared.sim.servo import CYCLE
from shared.sim.torque_arm import JOINTS, TorqueArm, TorqueLimiter
from shared.testing.fake_pr2 import arm_hold, jt_cartesian
from shared.testing.fake_pr2.arm_hold import ArmHold
from shared.testing.fake_pr2.jt_cartesian import JtCartesian

STRICT: Final = 2
"""Of a switch: an unknown name refuses the whole of it; otherwise it is passed over."""

GetParameters = Callable[[str], Mapping[str, Any]]
"""Returns what the parameter server holds in a namespace; empty where there is nothing."""


class Controller(Protocol):
    """What runs in the loop."""

    is_running: bool

    @property
    def type(self) -> str:
        """Return the name of its class."""
        ...

    def start(self, arm: TorqueArm, now: float) -> None:
        """Begin where the arm is now."""
        ...

    def update(self, arm: TorqueArm, now: float) -> Float64:
        """Return the torques of this cycle: float64[7] (N m)."""
        ...


class Elsewhere:
    """A controller of joints that stand still here: the other arm's, the head's."""

    def __init__(self, type_name: str) -> None:
        self.is_running = False
        self.type = type_name

    def start(self, arm: TorqueArm, now: float) -> None:
        """Do nothing."""

    def update(self, arm: TorqueArm, now: float) -> Float64:
        """Return no torques."""
        del arm, now
        return np.zeros(JOINTS)


@dataclass
class JointStatistics:
    """What is kept of the joints between two publications."""

    violated: Float64 = field(default_factory=lambda: np.zeros(JOINTS))
    """Non-zero where a joint was commanded more than it got."""
    fastest: Float64 = field(default_factory=lambda: np.zeros(JOINTS))
    strongest: Float64 = field(default_factory=lambda: np.zeros(JOINTS))


class Mechanism:
    """An arm in its 1 kHz loop."""

    def __init__(self, arm: TorqueArm, prefix: str, command_delay: float) -> None:
        """Begin with no controller, the motors on.

        Args:
            arm: the arm.
            prefix: ``r_`` or ``l_``, of the joints' names.
            command_delay: from a command's arrival to its effect (s).
        """
        self.arm = arm
        self._prefix = prefix
        self.joints = tuple(f"{prefix}{joint.name}_joint" for joint in arm.arm.joints)
        self.controllers: dict[str, Controller] = {}
        self.is_halted = False
        self.commanded = np.zeros(JOINTS)
        """float64[7], what the controllers want of the joints, limited (N m); may be NaN."""
        self.measured = np.zeros(JOINTS)
        """float64[7], what the motors give (N m)."""
        self.statistics = JointStatistics()
        self.cycles = 0
        self._delay = command_delay
        self._limiter = TorqueLimiter(arm.arm)
        self._was_halted = False

    @property
    def now(self) -> float:
        """Return the seconds of its own time."""
        return self.cycles * CYCLE

    def cycle(self) -> None:
        """Go on by a millisecond."""
        arm = self.arm
        self.cycles += 1
        now = self.now
        arm.sense()
        if self._was_halted and not self.is_halted:
            for controller in self._running():
                controller.start(arm, now)
        self._was_halted = self.is_halted
        torques = np.zeros(JOINTS)
        for controller in self._running():
            torques += controller.update(arm, now)
        self.commanded = self._limiter.limit(torques, arm.q, arm.qd)
        # A current that is not a number is an int16 of 0; a motor without power gives nothing.
        reached = np.where(np.isfinite(self.commanded), self.commanded, 0.0)
        self.measured = np.zeros(JOINTS) if self.is_halted else reached
        self._note()
        if self.is_halted:
            arm.coast()
        else:
            arm.drive(self.measured)

    def load(self, name: str, parameters: Mapping[str, Any]) -> bool:
        """Make a controller as its parameters say; False where it cannot be, or is there."""
        if name in self.controllers:
            return False
        made = self._make(parameters)
        if made is None:
            return False
        self.controllers[name] = made
        return True

    def unload(self, name: str) -> bool:
        """Remove a controller; False where there is none, or it runs."""
        found = self.controllers.get(name)
        if found is None or found.is_running:
            return False
        del self.controllers[name]
        return True

    def switch(self, start: Sequence[str], stop: Sequence[str], strictness: int) -> bool:
        """Stop and start controllers between two cycles; False changes nothing."""
        unknown = [name for name in (*start, *stop) if name not in self.controllers]
        if unknown and strictness == STRICT:
            return False
        for name in stop:
            if name in self.controllers:
                self.controllers[name].is_running = False
        for name in start:
            if (controller := self.controllers.get(name)) is not None:
                controller.is_running = True
                controller.start(self.arm, self.now)
        return True

    def jt(self, name: str) -> JtCartesian | None:
        """Return a loaded Cartesian controller."""
        found = self.controllers.get(name)
        return found if isinstance(found, JtCartesian) else None

    def cart_force(self) -> Float64:
        """Return float64[6], what all running Cartesian controllers put on the tool (N, N m)."""
        total = np.zeros(6)
        for controller in self._running():
            if isinstance(controller, JtCartesian):
                total = total + controller.force
        return total

    def _make(self, parameters: Mapping[str, Any]) -> Controller | None:
        name = parameters.get("type")
        if name == jt_cartesian.TYPE:
            read = jt_cartesian.read_parameters(parameters)
            if read is None or not read.tip_name.startswith(self._prefix):
                return None
            return JtCartesian(read, self.joints, self._delay)
        moved = parameters.get("joints") or [parameters.get("joint")]
        if name and not set(self.joints) & set(moved):
            return Elsewhere(str(name))
        if name == arm_hold.TYPE:
            gains = arm_hold.read_gains(parameters, self.joints)
            return None if gains is None else ArmHold(gains)
        return None

    def _running(self) -> list[Controller]:
        return [found for found in self.controllers.values() if found.is_running]

    def _note(self) -> None:
        kept = self.statistics
        kept.violated = kept.violated + (np.abs(self.commanded) > np.abs(self.measured))
        kept.fastest = np.maximum(kept.fastest, np.abs(self.arm.qd))
        kept.strongest = np.maximum(kept.strongest, np.abs(self.measured))
