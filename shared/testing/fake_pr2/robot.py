"""The whole robot, cycle by cycle, and when it says what; no threads, no clock, no wires."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, Protocol

import numpy as np

from shared.sim.arm import Float64
from shared.sim.parameters import load_parameters
from shared.sim.torque_arm import TorqueArm
from shared.testing.fake_pr2.config import ROOT, FakePr2Config
from shared.testing.fake_pr2.jt_cartesian import JtCartesian, JtState
from shared.testing.fake_pr2.mechanism import JointStatistics, Mechanism
from shared.testing.fake_pr2.power import SAMPLE_SECONDS, Power, PowerState

TORSO: Final = "torso_lift_joint"
QUATERNION_TOLERANCE: Final = 0.1
"""Of the squared length of a quaternion that tf takes."""


@dataclass(frozen=True)
class Joints:
    """Of the arm, from the shoulder to the wrist: float64[7] each."""

    names: tuple[str, ...]
    positions: Float64
    velocities: Float64
    efforts: Float64
    """Measured (N m)."""
    commanded: Float64
    """N m."""


class Outlet(Protocol):
    """Who hears what the robot says; called within a cycle, so it must not take long."""

    def joint_states(self, joints: Joints) -> None:
        """Hear the joints, 100 times a second."""
        ...

    def controller_state(self, name: str, state: JtState) -> None:
        """Hear a running Cartesian controller, 100 times a second."""
        ...

    def power_board(self, state: PowerState) -> None:
        """Hear the power board, 10 times a second."""
        ...

    def motors_halted(self, is_halted: bool) -> None:
        """Hear whether the motors are halted, as the robot says it."""
        ...

    def diagnostics(self, halted: str) -> None:
        """Hear once a second why the motors are halted; empty if they are not."""
        ...

    def statistics(
        self, joints: Joints, kept: JointStatistics, running: Mapping[str, bool], is_halted: bool
    ) -> None:  # fmt: skip
        """Hear the mechanism once a second, and which controllers run."""
        ...


class Robot:
    """A PR2 of which one arm moves."""

    def __init__(self, cfg: FakePr2Config, outlet: Outlet) -> None:
        """Begin, with no controller.

        Args:
            cfg: settings.
            outlet: who hears it.

        Raises:
            ConfigError: if the model that ``cfg`` names cannot be used.
        """
        arm = TorqueArm(cfg.sim, load_parameters(cfg.sim.model))
        self.mechanism = Mechanism(arm, cfg.prefix, cfg.command_delay)
        self.power = Power(auto_restart=cfg.auto_restart)
        self._outlet = outlet
        self.refused = 0
        """Commands that tf refused; their sender hears nothing of it."""

    def cycle(self) -> None:
        """Go on by a millisecond."""
        mechanism, power, outlet = self.mechanism, self.power, self._outlet
        now = mechanism.now
        if power.step(now):
            outlet.motors_halted(False)  # what they were until now; the truth comes within a second
        mechanism.is_halted = power.is_halted
        mechanism.cycle()
        cycle = mechanism.cycles
        for name, controller in mechanism.controllers.items():
            if controller.is_running and isinstance(controller, JtCartesian):
                self._publish(name, controller)
        if cycle % 10 == 0:
            outlet.joint_states(self.joints())
        if cycle % round(1000 * SAMPLE_SECONDS) == 0:
            outlet.power_board(power.sample(now))
        if cycle % 1000 == 0:
            self._say_slow_things()

    def joints(self) -> Joints:
        """Return the arm's joints now."""
        mechanism = self.mechanism
        return Joints(
            names=mechanism.joints,
            positions=mechanism.arm.q.copy(),
            velocities=mechanism.arm.qd.copy(),
            efforts=mechanism.measured.copy(),
            commanded=mechanism.commanded.copy(),
        )

    def load(self, name: str, parameters: Mapping[str, Any]) -> bool:
        """Load a controller as its namespace says; False where it cannot be, or is there."""
        return self.mechanism.load(name, parameters)

    def switch(self, start: Sequence[str], stop: Sequence[str], strictness: int = 2) -> bool:
        """Stop and start controllers; False changes nothing."""
        return self.mechanism.switch(start, stop, strictness)

    def command_pose(self, name: str, frame: str, pose: Float64, at: float) -> None:
        """Take what was published for a controller, as tf lets it through.

        Args:
            name: of the controller.
            frame: of the pose; its stamp does not matter in the robot's own frame.
            pose: float64[7], position and quaternion (w, x, y, z), whatever they are.
            at: when it arrived, on the mechanism's own time (s).
        """
        controller = self.mechanism.jt(name)
        square = float(pose[3:] @ pose[3:])
        if (
            controller is None
            or frame.removeprefix("/") != ROOT
            or not abs(square - 1.0) <= QUATERNION_TOLERANCE  # refuses NaN
        ):
            self.refused += 1
            return
        sound = pose.copy()
        sound[3:] /= np.sqrt(square)
        controller.command(sound, at)

    def halt_motors(self, reason: str = "service request") -> None:
        """Halt the motors, as the service and every fault of the hardware do."""
        if self.power.halt(reason):
            self._outlet.motors_halted(False)

    def reset_motors(self) -> None:
        """Bring the motors back, where they have power."""
        self.power.reset(self.mechanism.now)

    def _publish(self, name: str, controller: JtCartesian) -> None:
        if controller.is_due and controller.state is not None:
            self._outlet.controller_state(name, controller.state)

    def _say_slow_things(self) -> None:
        mechanism, power = self.mechanism, self.power
        self._outlet.motors_halted(power.is_halted)
        self._outlet.diagnostics(power.reason if power.is_halted else "")
        running = {name: found.is_running for name, found in mechanism.controllers.items()}
        self._outlet.statistics(self.joints(), mechanism.statistics, running, power.is_halted)
        mechanism.statistics = JointStatistics()
