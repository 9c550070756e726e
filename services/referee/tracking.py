"""Follows the bat states that arrive: which ticks are missing, and since when both bats are seen.

Time within the states is counted in their ticks, so that a burst after a hold-up of this process
is no gap; only silence is timed by this process's clock.
"""

import dataclasses

import numpy as np
from numpy.typing import NDArray

from shared.game.live import is_sound
from shared.messages.play import BatStates

Floats = NDArray[np.float64]


@dataclasses.dataclass(frozen=True)
class Arrival:
    """What a new tick is after the one before it."""

    missed: int
    """Ticks between the two that never arrived, or could not be used."""
    untracked: int
    """Ticks since both bats were last tracked; 0 for two good ticks in a row."""
    before: Floats | None
    """float64[2, 13], the states before; None for the first ones of a boot."""
    is_reboot: bool
    """They are another robot_io's than the ones before."""


class Tracking:
    """The newest states, and how good they have been."""

    def __init__(self, clock_now: float, stale_ticks: int) -> None:
        """Know nothing yet.

        Args:
            clock_now: now (s).
            stale_ticks: a longer gap between two good ticks ends a stretch of good ones.
        """
        self.boot: str = ""
        self.tick: int = -1
        """The newest; -1 before the first."""
        self.bats: Floats | None = None
        """float64[2, 13]."""
        self.good_at = clock_now
        """When both bats were last tracked (s)."""
        self.good_ticks = 0
        """Ticks for which they have been, short gaps apart."""
        self._good_tick = -1
        self._stale_ticks = stale_ticks
        self.counters = {"states": 0, "states_refused": 0, "states_late": 0, "states_invalid": 0}

    def take(self, states: BatStates, now: float) -> Arrival | None:
        """Enter states; return how they follow the ones before, None if they are of no use.

        Args:
            states: as they arrived.
            now: the clock (s).
        """
        self.counters["states"] += 1
        if states.tick < 0 or not is_sound(states.bats).all():
            self.counters["states_refused"] += 1
            return None
        is_first = not self.boot
        is_reboot = not is_first and states.boot != self.boot
        if not (is_first or is_reboot) and states.tick <= self.tick:
            self.counters["states_late"] += 1
            return None
        if is_first or is_reboot:
            self.good_ticks = 0
            self._good_tick = states.tick - 1
            arrival = Arrival(0, 0, None, is_reboot)
        else:
            missed = states.tick - self.tick - 1
            untracked = states.tick - self._good_tick - 1
            arrival = Arrival(missed, untracked, self.bats, is_reboot)
        self.boot, self.tick, self.bats = states.boot, states.tick, states.bats
        self._judge_quality(bool(states.is_valid.all()), arrival.untracked, now)
        return arrival

    def _judge_quality(self, is_good: bool, untracked: int, now: float) -> None:
        if not is_good:
            self.counters["states_invalid"] += 1
            self.good_ticks = 0
            return
        self.good_ticks = 1 if untracked > self._stale_ticks else self.good_ticks + 1
        self._good_tick = self.tick
        self.good_at = now
