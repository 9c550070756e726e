"""Faults of the cable between a run and another host, on which two of its three actors are."""

from pathlib import Path

from services.jobs.chaos.far_host import (
    CONNECT,
    CUT_SECONDS,
    DELAY,
    LOSS,
    LOSSY_SECONDS,
    FarHost,
)
from services.jobs.chaos.faults import UP_SECONDS, Blow, Chance, Fault
from services.jobs.chaos.job import Job
from services.supervisor import service_command
from shared.clock import Clock
from shared.testing.network.hosts import Network

FAR = ("actor-far-0", "actor-far-1")


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
        self.far = FarHost(network)

    def settle(self) -> None:
        """Let the far actors join before anything is measured."""
        if not self.far.join(self):
            return
        for name in FAR:
            command = service_command(
                "actor", name=name, run=self.folder, site=self.folder / "config.toml",
                run_id=self.endpoint.run, connect=(CONNECT,),
            )  # fmt: skip
            self.far.start(command, self)
        self.until(lambda: all(name in self.up for name in FAR), UP_SECONDS)
        super().settle()

    def close(self) -> None:
        """Leave no process of it behind."""
        self.far.close()
        super().close()


def _cut(job: SplitJob, _chance: Chance) -> Blow:
    at = job.clock.now()
    with job.far.cut():
        job.rest(CUT_SECONDS)
    over = job.clock.now()
    return Blow("two of three actors", at, over, over, note=_missing(job))


def _delay(job: SplitJob, _chance: Chance) -> Blow:
    at = job.clock.now()
    with job.far.slowed() as note:
        job.rest(LOSSY_SECONDS)
    over = job.clock.now()
    return Blow("two of three actors", at, over, over, note=f"{note} {_missing(job)}".strip())


def _missing(job: SplitJob) -> str:
    ended = sum(process.poll() is not None for process in job.far.host.processes[1:])
    return f"{ended} processes of the far host have ended" if ended else ""


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
