"""A match whose robot may be played by a policy on another host."""

from pathlib import Path

from services.jobs.chaos.far_host import FarHost
from services.jobs.chaos.robot.match import Match
from shared.clock import Clock
from shared.testing.network.hosts import Network


class FarMatch(Match):
    """A match and a host that is joined to it."""

    def __init__(self, network: Network, folder: Path, clock: Clock, *, seed: int) -> None:
        """Prepare as any match.

        Args:
            network: in which to make the far host.
            folder: of the run.
            clock: of the watching.
            seed: of the run.
        """
        super().__init__(folder, clock, seed=seed)
        self.far = FarHost(network)

    def settle(self) -> None:
        """Join the far host before anything is measured."""
        if self.far.join(self):
            super().settle()

    def close(self) -> None:
        """Leave no process of it behind."""
        self.far.close()
        super().close()
