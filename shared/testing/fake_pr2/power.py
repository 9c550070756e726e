"""Run stops, circuits and what brings the motors back, on the robot's own time.

A pressed stop takes the power from the circuits, and motors without power halt. Nothing that is
released moves anything by itself; but a PR2 runs a node, pr2_run_stop_auto_restart, that watches
the power board: when the run stop reads released again, it starts the circuits, waits two seconds
and resets the motors. Its rising edge is that of the board's ten samples a second.
"""

from dataclasses import dataclass
from typing import Final

CIRCUITS: Final = 3
"""Base, right arm, left arm."""
STANDBY: Final = 1
PUMPING: Final = 2
ENABLED: Final = 3
PUMP_SECONDS: Final = 0.3
"""From starting a circuit to its power. Our estimate; the two seconds below include it."""
AUTO_RESET_SECONDS: Final = 2.0
"""From starting the circuits to resetting the motors (run_stop_auto_restart.cpp)."""
RESET_SECONDS: Final = 0.08
"""The motors' own reset takes some cycles a slave."""
SAMPLE_SECONDS: Final = 0.1
"""Of the power board."""


@dataclass(frozen=True)
class PowerState:
    """What the power board says."""

    circuits: tuple[int, ...]
    run_stop: bool
    """True while nothing is pressed; not to be told from the wireless stop while that is."""
    wireless_stop: bool
    """True while it is not pressed."""


class Power:
    """The board, the motors and the node that restarts them."""

    def __init__(self, *, auto_restart: bool) -> None:
        """Begin with everything on.

        Args:
            auto_restart: whether pr2_run_stop_auto_restart runs.
        """
        self.is_pressed = False
        """The run stop."""
        self.is_wireless_pressed = False
        self.is_halted = False
        """Whether the motors are."""
        self.reason = ""
        """Why they are."""
        self._auto_restart = auto_restart
        self._circuits = [ENABLED] * CIRCUITS
        self._pump_until = [0.0] * CIRCUITS
        self._reset_at: float | None = None
        self._auto_reset_at: float | None = None
        self._sampled = self.state()

    @property
    def is_stopped(self) -> bool:
        """Return whether a stop is pressed."""
        return self.is_pressed or self.is_wireless_pressed

    def state(self) -> PowerState:
        """Return what the board would say now."""
        return PowerState(
            circuits=tuple(self._circuits),
            run_stop=not self.is_stopped,
            wireless_stop=not self.is_wireless_pressed,
        )

    def sample(self, now: float) -> PowerState:
        """Return what the board says, and let the restarting node hear it."""
        before, self._sampled = self._sampled, self.state()
        if self._auto_restart and self._sampled.run_stop and not before.run_stop:
            for circuit in range(CIRCUITS):
                self.start_circuit(circuit, now)
            self._auto_reset_at = now + AUTO_RESET_SECONDS
        return self._sampled

    def start_circuit(self, circuit: int, now: float) -> bool:
        """Give a circuit its power; False while a stop is pressed."""
        if self.is_stopped:
            return False
        if self._circuits[circuit] != ENABLED:
            self._circuits[circuit] = PUMPING
            self._pump_until[circuit] = now + PUMP_SECONDS
        return True

    def stop_circuit(self, circuit: int) -> None:
        """Take the power from a circuit."""
        self._circuits[circuit] = STANDBY

    def halt(self, reason: str) -> bool:
        """Halt the motors; False if they are already."""
        self._reset_at = None
        if self.is_halted:
            return False
        self.is_halted, self.reason = True, reason
        return True

    def reset(self, now: float) -> None:
        """Bring the motors back, in a moment, where they have power."""
        self._reset_at = now + RESET_SECONDS

    def step(self, now: float) -> bool:
        """Go on to now; return whether the motors halted just now."""
        for circuit in range(CIRCUITS):
            if self.is_stopped:
                self._circuits[circuit] = STANDBY
            elif self._circuits[circuit] == PUMPING and now >= self._pump_until[circuit]:
                self._circuits[circuit] = ENABLED
        if self._auto_reset_at is not None and now >= self._auto_reset_at:
            self._auto_reset_at = None
            self.reset(now)
        if self._reset_at is not None and now >= self._reset_at:
            self._reset_at = None
            self.is_halted = False
        if any(circuit != ENABLED for circuit in self._circuits):
            return self.halt("undervoltage")
        return False
