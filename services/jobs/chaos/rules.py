"""Whether what went to a robot kept to the rules of the gate, judged from outside it."""

import numpy as np

from services.robot_io.config import SafetyConfig
from shared.messages.message import Array
from shared.messages.play import GateState

PERIOD = 0.01
"""Of the gate (s)."""
ROUNDING = 1e-6
NEAR_TICKS = 20
"""Two commands further apart say nothing of the speed between them."""
SHUT = ("disarmed", "tripped")


class Rules:
    """Looks at every state of the gate that arrives: nothing from its own code is asked."""

    def __init__(self, cfg: SafetyConfig) -> None:
        """Begin with a gate that nobody has armed.

        Args:
            cfg: the limits.
        """
        self._cfg = cfg
        self._before: GateState | None = None
        self._was_shut = False
        """It was shut, and no person has armed it since."""
        self.checked = 0
        """States looked at."""

    def note_arming(self, *, may_open: bool) -> None:
        """Note that a person asks to arm, or was told that it is not done."""
        self._was_shut = not may_open

    def broken_by(self, gate: GateState) -> bool:
        """Return whether a state shows a command that must not be."""
        self.checked += 1
        before, self._before = self._before, gate
        is_shut = gate.mode in SHUT
        if before is not None and before.mode not in SHUT and is_shut:
            self._was_shut = True
        if not gate.is_sent:
            return False
        if is_shut or self._was_shut or not np.isfinite(gate.commanded).all():
            return True
        return self._is_outside(gate.commanded) or self._is_too_fast(before, gate)

    def _is_outside(self, pose: Array) -> bool:
        place, cfg = pose[:3], self._cfg
        low, high = np.array(cfg.box_low) - ROUNDING, np.array(cfg.box_high) + ROUNDING
        return bool((place < low).any() or (place > high).any())

    def _is_too_fast(self, before: GateState | None, gate: GateState) -> bool:
        if before is None or not before.is_sent:
            return False
        ticks = gate.tick - before.tick
        if not 0 < ticks <= NEAR_TICKS:
            return False
        way = float(np.linalg.norm(gate.commanded[:3] - before.commanded[:3]))
        return way > self._cfg.game_speed * PERIOD * ticks * (1.0 + ROUNDING) + ROUNDING
