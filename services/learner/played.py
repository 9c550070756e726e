"""Which play of a lease was handed over: under another name an old rollout would count again."""

from shared.bus.ranges import Ranges
from shared.messages.training import Rollout

KEPT_BOUTS = 4
"""Bouts of a lease that are remembered, for each world; older ones count as handed over. They last
equally long, so those that are played now are among the newest two a world."""


class Played:
    """Bouts and their steps, of one lease; as much memory as bouts are played side by side."""

    def __init__(self) -> None:
        """Begin with a lease of which nothing was handed over."""
        self._steps: dict[int, Ranges] = {}
        """By bout."""
        self._newest = -1
        self._floor = 0
        """Bouts below it count as handed over."""

    def __len__(self) -> int:
        """Return how many bouts are remembered."""
        return len(self._steps)

    def known(self, rollout: Rollout) -> tuple[int, int] | None:
        """Return a bout and a step that were handed over before; None: all of it is new.

        Args:
            rollout: its contents already checked.
        """
        steps = len(rollout.rewards)
        for bout, first in zip(rollout.bouts.tolist(), rollout.first_step.tolist(), strict=True):
            held = self._steps.get(bout)
            if bout < self._floor or (held is not None and held.overlaps(first, first + steps - 1)):
                return bout, first
        return None

    def add(self, rollout: Rollout) -> None:
        """Remember the play of a rollout, and forget bouts that ended long ago."""
        steps = len(rollout.rewards)
        for bout, first in zip(rollout.bouts.tolist(), rollout.first_step.tolist(), strict=True):
            self._steps.setdefault(bout, Ranges()).cover(first, first + steps - 1)
        self._newest = max(self._newest, int(rollout.bouts.max()))
        floor = self._newest + 1 - KEPT_BOUTS * max(rollout.worlds, len(rollout.bouts))
        if floor > self._floor:
            self._floor = floor
            for bout in [bout for bout in self._steps if bout < floor]:
                del self._steps[bout]
