"""What the bus said last of the bout, and who is silent."""

import math

from shared.bus.base import Bus
from shared.messages.live import ServiceStatus
from shared.messages.play import ArmStates, BatStates, GateState, HeartRate, RefereeState
from shared.messages.topics import ARMS, BATS, GATE, HEART_RATE, REFEREE, STATUS
from shared.messages.training import Agent

TAKE_MOST = 64
"""Values of one topic taken at a time, so that a flood cannot hold up the rest."""
BATS_SILENCE = 0.5
"""Without bat states for so long, robot_io counts as silent (s)."""
HEART_SILENCE = 5.0
"""A heart rate older than this is not shown (s)."""
STATUS_SILENCE = 3.5
"""A status older than this is not shown (s)."""


class Hearing:
    """The newest of everything the page shows."""

    def __init__(self, bus: Bus, sides: tuple[Agent, ...]) -> None:
        """Listen.

        Args:
            bus: this process's end of the bus.
            sides: those that a policy plays.
        """
        self._bus = bus
        self._sides = sides
        self._bats = bus.subscribe(BATS)
        self._arms = bus.subscribe(ARMS)
        self._gate = bus.subscribe(GATE)
        self._referee = bus.subscribe(REFEREE)
        self._heart_rate = bus.subscribe(HEART_RATE)
        self._status = bus.subscribe(STATUS, role="robot-io")
        self.bats: BatStates | None = None
        self.arms: ArmStates | None = None
        self.gate: GateState | None = None
        self.referee: RefereeState | None = None
        self._beat: HeartRate | None = None
        self._said: ServiceStatus | None = None
        self._bats_at = self._beat_at = self._said_at = -math.inf
        for role in ("referee", "policy"):
            bus.alive(role)  # begins to watch for them

    def listen(self, now: float) -> bool:
        """Take what has arrived; return whether bat states did."""
        has_bats = False
        for _ in range(TAKE_MOST):
            if (bats := self._bats.take()) is None:
                break
            self.bats, self._bats_at, has_bats = bats, now, True
        for _ in range(TAKE_MOST):
            if (arms := self._arms.take()) is None:
                break
            self.arms = arms
        for _ in range(TAKE_MOST):
            if (beat := self._heart_rate.take()) is None:
                break
            self._beat, self._beat_at = beat, now
        if (gate := self._gate.take()) is not None:
            self.gate = gate
        if (referee := self._referee.take()) is not None:
            self.referee = referee
        if (said := self._status.take()) is not None:
            self._said, self._said_at = said, now
        return has_bats

    def heart_rate(self, now: float) -> float | None:
        """Return the beats per minute of whoever plays, None where nobody measures."""
        if self._beat is None or now - self._beat_at > HEART_SILENCE:
            return None
        return self._beat.beats_per_minute

    def rates(self, now: float) -> dict[str, float]:
        """Return what robot_io measures of itself, by name with unit; empty while it is silent."""
        if self._said is None or now - self._said_at > STATUS_SILENCE:
            return {}
        return self._said.rates

    def is_robot_io_silent(self, now: float) -> bool:
        """Return whether no bat states arrive."""
        return now - self._bats_at > BATS_SILENCE

    def missing(self, now: float) -> list[str]:
        """Return whom a bout has to wait for, as people say it."""
        names: list[str] = []
        if self.is_robot_io_silent(now):
            names.append("robot_io")
        if not self._bus.alive("referee"):
            names.append("the referee")
        lack = len(self._sides) - len(self._bus.alive("policy"))
        if lack > 0:
            names.append("the policy" if lack == 1 else "the policies")
        return names

    def close(self) -> None:
        """Stop listening."""
        for one in (
            self._bats, self._arms, self._gate, self._referee, self._heart_rate, self._status,
        ):  # fmt: skip
            one.close()
