"""Whether what went to a robot kept to the rules of the gate, judged from outside it.

Nothing of the gate's own code is used: speeds and accelerations are differences of what was sent.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from services.robot_io.config import SafetyConfig
from shared.messages.message import Array
from shared.messages.play import GateState
from shared.sim.config import SimConfig
from shared.sim.model import FencingModel
from shared.sim.plant.poses import conjugate, product, rotated, rotation_vectors

Floats = NDArray[np.float64]

PERIOD = 0.01
"""Of the gate (s)."""
ROUNDING = 1e-6
"""Relative, and in m, m/s or rad/s."""
NEAR_TICKS = 20
"""Two commands further apart say nothing of the speed between them."""
SHUT = ("disarmed", "tripped")


class Bat(NamedTuple):
    """The bat in the tool's frame: a capsule."""

    ends: Floats
    """Of its axis, float64[2, 3] (m)."""
    radius: float
    """m."""

    @staticmethod
    def of(cfg: SimConfig) -> "Bat":
        """Return the robot's bat as the simulator has it."""
        model = FencingModel.build(cfg)
        angle = model.parameters.bat.mount_angle
        along = np.array([np.cos(angle), 0.0, np.sin(angle)])
        return Bat(np.array([model.bat_back * along, model.bat_front * along]), model.bat_radius)


class _Step(NamedTuple):
    """How the command moved from one tick to the next."""

    velocity: Floats
    """float64[3] (m/s)."""
    spin: Floats
    """float64[3], in the fixed frame (rad/s)."""


class Rules:
    """Looks at every state of the gate that arrives."""

    def __init__(self, cfg: SafetyConfig, bat: Bat) -> None:
        """Begin with a gate that nobody has armed.

        Args:
            cfg: the limits.
            bat: what the robot holds.
        """
        self._cfg = cfg
        self._bat = bat
        self._before: GateState | None = None
        self._step: _Step | None = None
        """The last one, where it took a single tick."""
        self._was_shut = False
        """It was shut, and no person has armed it since."""
        self.checked = 0
        """States looked at."""
        self.accelerations = 0
        """Those that came right after two others, so that their acceleration was looked at."""

    def note_arming(self, *, may_open: bool) -> None:
        """Note that a person asks to arm, or was told that it is not done."""
        self._was_shut = not may_open

    def broken_by(self, gate: GateState) -> str:
        """Return which rule a state shows broken; empty where none is."""
        self.checked += 1
        before, self._before = self._before, gate
        is_shut = gate.mode in SHUT
        if before is not None and before.mode not in SHUT and is_shut:
            self._was_shut = True
        if not gate.is_sent:
            self._step = None
            return ""
        if is_shut:
            return f"sent while {gate.mode}"
        if self._was_shut:
            return "sent after it was shut, and nobody armed it"
        if not np.isfinite(gate.commanded).all():
            return "sent what is no number"
        return self._misplaced(gate.commanded) or self._rushed(before, gate)

    def _misplaced(self, pose: Array) -> str:
        """Return what is wrong with where a command leads."""
        place, cfg = pose[:3], self._cfg
        low, high = np.array(cfg.box_low) - ROUNDING, np.array(cfg.box_high) + ROUNDING
        if (place < low).any() or (place > high).any():
            return "outside the box"
        ends = place + rotated(pose[3:], self._bat.ends)
        if ends[:, 2].max() + self._bat.radius > cfg.ceiling + ROUNDING:
            return "bat above the ceiling"
        gap = _gap(ends[:, :2], np.array(cfg.keep_out))
        if gap < cfg.keep_out_radius + self._bat.radius - ROUNDING:
            return "bat where the person stands"
        return ""

    def _rushed(self, before: GateState | None, gate: GateState) -> str:
        """Return what is wrong with how the command moved there."""
        earlier, self._step = self._step, None
        if before is None or not before.is_sent:
            return ""
        ticks = gate.tick - before.tick
        if not 0 < ticks <= NEAR_TICKS:
            return ""
        step, cfg = _step(before.commanded, gate.commanded, ticks * PERIOD), self._cfg
        if _is_over(step.velocity, cfg.game_speed):
            return "over the game speed"
        if _is_over(step.spin, cfg.turn_speed):
            return "over the turn speed"
        if ticks > 1:
            return ""
        self._step = step
        if earlier is None:
            return ""
        self.accelerations += 1
        if _is_over(step.velocity - earlier.velocity, cfg.acceleration * PERIOD):
            return "over the acceleration"
        if _is_over(step.spin - earlier.spin, cfg.turn_acceleration * PERIOD):
            return "over the turn acceleration"
        return ""


def _step(one: Array, other: Array, seconds: float) -> _Step:
    turn = rotation_vectors(product(other[3:], conjugate(one[3:])))
    return _Step((other[:3] - one[:3]) / seconds, turn / seconds)


def _is_over(vector: Floats, limit: float) -> bool:
    return float(np.linalg.norm(vector)) > limit * (1.0 + ROUNDING) + ROUNDING


def _gap(ends: Floats, point: Floats) -> float:
    """Return how near a line between two points comes to a third one, float64[2, 2] and [2]."""
    way = ends[1] - ends[0]
    square = float(way @ way)
    share = 0.0 if square == 0.0 else float(np.clip((point - ends[0]) @ way / square, 0.0, 1.0))
    return float(np.linalg.norm(ends[0] + share * way - point))
