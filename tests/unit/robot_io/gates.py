"""A gate, and inputs in which everything is in order."""

from typing import Any

import msgspec

from services.robot_io.config import SafetyConfig
from services.robot_io.gate import Gate, GateInputs, GateMemory, GateOutput
from services.robot_io.limits import Blade
from services.robot_io.poses import Pose

PERIOD = 0.01
BLADE = Blade(direction=(0.70710678, 0.0, 0.70710678), front=0.7, back=-0.05, radius=0.025)
START = Pose((0.553, -0.25, 0.0), (1.0, 0.0, 0.0, 0.0))


class Driven:
    """A gate with a tool that is always where it was commanded, one tick at a time."""

    def __init__(self, **limits: Any) -> None:
        self.cfg = SafetyConfig(**limits)
        self.gate = Gate(self.cfg, BLADE, PERIOD)
        self.memory = GateMemory()
        self.now = 100.0
        self.measured = START
        self.command: Pose | None = START
        self.sent: list[Pose | None] = []
        self.output = GateOutput(command=None)

    def inputs(self, **changed: Any) -> GateInputs:
        inputs = GateInputs(
            now=self.now, measured=self.measured, state_at=self.now, speed=0.0,
            command=self.command, tracker_at=self.now, is_tracked=True,
        )  # fmt: skip
        return msgspec.structs.replace(inputs, **changed)

    def step(self, ticks: int = 1, **changed: Any) -> "Driven":
        for _ in range(ticks):
            self.now += PERIOD
            self.memory, self.output = self.gate.step(self.memory, self.inputs(**changed))
            self.sent.append(self.output.command)
            self.measured = self.output.command or self.measured
        return self

    def arm(self) -> tuple[str, ...]:
        self.memory, reasons = self.gate.arm(self.memory, self.inputs())
        return reasons

    def armed(self) -> "Driven":
        self.step()
        assert self.arm() == ()
        self.step(round(self.cfg.ramp / PERIOD) + 1)
        assert self.memory.mode == "armed"
        return self

    def toward(self, x: float = 0.0, y: float = 0.0, z: float = 0.0) -> Pose:
        """Return the measured pose moved by an offset."""
        a, b, c = self.measured.position
        return Pose((a + x, b + y, c + z), self.measured.orientation)

    def fencing(self, speed_ticks: int = 40) -> "Driven":
        """Arm and get to full speed along y."""
        self.armed()
        for _ in range(speed_ticks):
            self.command = self.toward(y=0.1)
            self.step()
        return self
