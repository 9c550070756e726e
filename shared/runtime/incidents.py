"""What a process tells the report of a run: each a line in it."""

import math

from shared.bus.base import Bus
from shared.bus.delivery import Outbox
from shared.clock import Clock
from shared.messages.league import Incident
from shared.messages.topics import INCIDENT
from shared.messages.training import Receipt

TIMEOUT = 5.0
"""Seconds to wait for the league before one is told again."""


class Incidents:
    """On their way to the league, each until it is entered."""

    def __init__(self, bus: Bus, clock: Clock, window: int, most: float = math.inf) -> None:
        """Tell nothing yet.

        Args:
            bus: where the league answers.
            clock: dates them, and spaces the attempts.
            window: how many may wait for the league; more are left out.
            most: how many this process tells; a flood would say nothing more.
        """
        self._bus = bus
        self._clock = clock
        self._most = most
        self._sequence = 0
        self._outbox: Outbox[Incident, Receipt] = Outbox(
            bus, INCIDENT, clock, window=window, timeout=TIMEOUT
        )

    @property
    def unacknowledged(self) -> int:
        """Return how many wait for the league."""
        return self._outbox.unacknowledged

    def note(self, kind: str, detail: str) -> None:
        """Tell of something worth a line; of no more than there is room for."""
        if self._outbox.full or self._sequence >= self._most:
            return
        self._outbox.put(
            Incident(
                source=self._bus.name,
                boot=self._bus.boot,
                sequence=self._sequence,
                kind=kind,
                detail=detail,
                at_ns=self._clock.wall_ns(),
            )
        )
        self._sequence += 1

    def pump(self) -> None:
        """Send what is due, take the answers."""
        self._outbox.pump()
