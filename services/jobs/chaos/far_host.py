"""Another host that takes part in a run, and faults of the cable between the two.

The host is a network namespace with a link that is really cut. On either end of the link stands a
relay, because without certificates the bus takes no endpoint but the machine's own.
"""

import contextlib
import os
import signal
import subprocess
import sys
from collections.abc import Generator, Sequence

from services.jobs.chaos.faults import UP_SECONDS
from services.jobs.chaos.job import Job
from shared.bus.ports import free_port
from shared.testing.network.commands import no_loss
from shared.testing.network.hosts import Network

PORT = 7447
"""Of the relay on the far host's own address."""
CONNECT = f"tcp/127.0.0.1:{PORT}"
"""Where a process on the far host finds the run."""
CUT_SECONDS = 10.0
LOSSY_SECONDS = 15.0
DELAY = 0.1
LOSS = 0.05


class FarHost:
    """A host, and its connection to one run."""

    def __init__(self, network: Network) -> None:
        """Take the host, or make it.

        Args:
            network: that it is in.
        """
        self.host = network.hosts.get("far") or network.host("far")
        self._here = f"{network.address}:{free_port()}"
        self._relay: subprocess.Popen[bytes] | None = None

    def join(self, job: Job) -> bool:
        """Join the host to a run that has begun; return whether the run came up in time."""
        if not job.until(lambda: (job.folder / "endpoint.json").exists(), UP_SECONDS):
            return False
        there = job.endpoint.connect.removeprefix("tcp/")
        relay = [sys.executable, "-P", "-m", "shared.testing.network.relay", self._here, there, "0"]
        job.let_in(relay)
        self.pass_on(0.0)
        return True

    def pass_on(self, delay: float) -> None:
        """Join the host's own address to the run, later by so much in each direction (s)."""
        if self._relay is not None:
            self._relay.send_signal(signal.SIGKILL)
            self._relay.wait()
        self._relay = self.host.relay(PORT, self._here, delay)

    def start(self, command: Sequence[str], job: Job) -> "subprocess.Popen[bytes]":
        """Start a process there that joins the run at ``CONNECT``."""
        with job.folder.with_suffix(".out").open("ab") as output:
            env = {**os.environ, "OMP_NUM_THREADS": "1"}
            return self.host.start(*command, stdout=output, stderr=output, env=env)

    @contextlib.contextmanager
    def slowed(self) -> Generator[str]:
        """Delay and lose while the context lasts; gives a note where the kernel cannot lose."""
        self.pass_on(DELAY)
        problem = no_loss()
        try:
            if not problem:
                self.host.lose(LOSS)
            yield f"no loss: {problem}" if problem else ""
        finally:
            if not problem:
                self.host.lose(0.0)
            self.pass_on(0.0)

    @contextlib.contextmanager
    def cut(self) -> Generator[None]:
        """Pull the cable while the context lasts."""
        self.host.cut()
        try:
            yield
        finally:
            self.host.heal()

    def close(self) -> None:
        """Plug the cable in and leave no process there."""
        self.host.heal()
        self.host.end()
