"""Two actors on another host, and faults of the cable between it and the rest of the run.

The host is a network namespace with a link that is really cut. On either end of the link stands a
relay, because without certificates the bus takes no endpoint but the machine's own.
"""

import os
import signal
import subprocess
import sys
from pathlib import Path

from services.jobs.chaos.faults import UP_SECONDS, Blow, Chance, Fault
from services.jobs.chaos.job import Job
from services.supervisor import service_command
from shared.bus.ports import free_port
from shared.clock import Clock
from shared.testing.network.commands import no_loss, unavailable
from shared.testing.network.hosts import Network

FAR = ("actor-far-0", "actor-far-1")
PORT = 7447
"""Of the relay on the far host's own address."""
CUT_SECONDS = 10.0
LOSSY_SECONDS = 15.0
DELAY = 0.1
LOSS = 0.05


class SplitJob(Job):
    """A run whose actors, but for one, are on another host."""

    def __init__(self, network: Network, folder: Path, clock: Clock, *, seed: int) -> None:
        """Prepare as any job.

        Args:
            network: in which to make the far host.
            folder: of the run.
            clock: of the watching.
            seed: of the run.
        """
        super().__init__(folder, clock, seed=seed, overrides=("train.actors=1",))
        self.host = network.hosts.get("far") or network.host("far")
        self._here = f"{network.address}:{free_port()}"
        self._relay: subprocess.Popen[bytes] | None = None

    def settle(self) -> None:
        """Let the far actors join before anything is measured."""
        if not self.until(lambda: (self.folder / "endpoint.json").exists(), UP_SECONDS):
            return
        place = self.endpoint
        there = place.connect.removeprefix("tcp/")
        relay = [sys.executable, "-P", "-m", "shared.testing.network.relay", self._here, there, "0"]
        self.let_in(relay)
        self.pass_on(0.0)
        with self.folder.with_suffix(".out").open("ab") as output:
            for name in FAR:
                command = service_command(
                    "actor", name=name, run=self.folder, site=self.folder / "config.toml",
                    run_id=place.run, connect=(f"tcp/127.0.0.1:{PORT}",),
                )  # fmt: skip
                self.host.start(*command, stdout=output, stderr=output, env=dict(os.environ))
        self.until(lambda: all(name in self.up for name in FAR), UP_SECONDS)
        super().settle()

    def pass_on(self, delay: float) -> None:
        """Join the far host's own address to the run, later by so much in each direction (s)."""
        if self._relay is not None:
            self._relay.send_signal(signal.SIGKILL)
            self._relay.wait()
        self._relay = self.host.relay(PORT, self._here, delay)

    def close(self) -> None:
        """Leave no process of it behind."""
        self.host.heal()
        self.host.end()
        super().close()


def _cut(job: SplitJob, _chance: Chance) -> Blow:
    at = job.clock.now()
    job.host.cut()
    try:
        job.rest(CUT_SECONDS)
    finally:
        job.host.heal()
    over = job.clock.now()
    return Blow("two of three actors", at, over, over, note=_missing(job))


def _delay(job: SplitJob, _chance: Chance) -> Blow:
    at = job.clock.now()
    job.pass_on(DELAY)
    lossy = not no_loss()
    try:
        if lossy:
            job.host.lose(LOSS)
        job.rest(LOSSY_SECONDS)
    finally:
        if lossy:
            job.host.lose(0.0)
        job.pass_on(0.0)
    over = job.clock.now()
    note = "" if lossy else f"no loss: {no_loss()}"
    return Blow("two of three actors", at, over, over, note=f"{note} {_missing(job)}".strip())


def _missing(job: SplitJob) -> str:
    ended = sum(process.poll() is not None for process in job.host.processes[1:])
    return f"{ended} processes of the far host have ended" if ended else ""


def why_not() -> str:
    """Return why there can be no other host here; empty when there can."""
    return unavailable()


FAULTS: tuple[Fault[SplitJob], ...] = (
    Fault(
        "network-cut", f"cable pulled for {CUT_SECONDS:g} s, then plugged in again",
        "the host of two of three actors", _cut, seconds=CUT_SECONDS,
    ),
    Fault(
        "network-slow", f"{1e3 * DELAY:.0f} ms more each way and {100 * LOSS:.0f} % of packets "
        f"lost for {LOSSY_SECONDS:g} s", "the host of two of three actors", _delay,
        seconds=LOSSY_SECONDS,
    ),
)  # fmt: skip
