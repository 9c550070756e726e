"""The processes of a training site with synthetic actors in place of real ones, and what they use.

Messages go through sockets even on this machine, as they would from other machines
(``bus.shared_memory=false``).
"""

import contextlib
import dataclasses
import shutil
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import msgspec
import psutil

from benchmarks.scaling.synthetic import Totals
from benchmarks.training_run import RunReader
from services.jobs.settings import Settings
from services.jobs.train.command import processes
from services.supervisor import ProcessSpec, Supervisor
from shared.bus.ports import free_port
from shared.clock import SystemClock
from shared.errors import RiposteError

START_SECONDS = 240.0
POLL_SECONDS = 0.2
LEARNER = "learner-antagonist"
ENDLESS = ("league.antagonist_updates=1000000", "league.convergence_min_updates=0")
OVER_SOCKETS = ("bus.shared_memory=false", "train.record=false", "recorder.live=false")


@dataclasses.dataclass(frozen=True)
class Crowd:
    """Which synthetic actors a site has, and what its learner does."""

    actors: int
    rollouts_per_s: float
    """Offered by all of them together; 0: as many as are acknowledged."""
    batch_rollouts: int
    """In one update."""
    num_envs: int
    """Bouts in a rollout of 40 steps."""
    hosts: int = 2
    """Processes they share."""
    updates: bool = False
    """Whether the learner runs PPO."""

    @property
    def period(self) -> float:
        """Return the seconds between two rollouts of one actor."""
        return self.actors / self.rollouts_per_s if self.rollouts_per_s else 0.0

    @property
    def batch_samples(self) -> int:
        """Return the samples in one update."""
        return self.batch_rollouts * self.num_envs * 40


@dataclasses.dataclass(frozen=True)
class Moment:
    """Where a site stood."""

    at: float
    cpu: dict[str, float]
    """CPU seconds used so far, by process."""
    learner_thread: float
    """The same of the learner's main thread."""
    version: int
    totals: list[Totals]
    """The newest of each host."""


class ScalingSite(RunReader):
    """Router, league, learners and hosts of synthetic actors, all running."""

    def __init__(self, specs: list[ProcessSpec], folder: Path, crowd: Crowd) -> None:
        super().__init__(folder)
        self.crowd = crowd
        self._supervisor = Supervisor(specs, folder / "logs", SystemClock())
        self._supervisor.start()

    @property
    def pids(self) -> dict[str, int]:
        """Return the process ids by name."""
        return self._supervisor.pids

    def totals(self) -> list[Totals]:
        """Return the newest totals of each host that has any."""
        found: list[Totals] = []
        for path in sorted(self.folder.glob("host-*.jsonl")):
            lines = path.read_bytes().splitlines(keepends=True)
            whole = [line for line in lines if line.endswith(b"\n")]
            if whole:
                found.append(msgspec.json.decode(whole[-1], type=Totals))
        return found

    def until_busy(self) -> None:
        """Wait until every actor has a lease and the learner has made versions from rollouts.

        Raises:
            RiposteError: a process died, or it took too long.
        """
        end = time.monotonic() + START_SECONDS
        while time.monotonic() < end:
            self.check()
            leased = sum(totals.leased for totals in self.totals())
            if leased == self.crowd.actors and self.newest_checkpoint() >= 2:
                return
            time.sleep(POLL_SECONDS)
        raise RiposteError(
            f"{sum(totals.leased for totals in self.totals())} of {self.crowd.actors} actors had a "
            f"lease after {START_SECONDS:g} s, version {self.newest_checkpoint()}: see "
            f"{self.folder / 'logs'}"
        )

    def check(self) -> None:
        """Look after the processes.

        Raises:
            RiposteError: one of them died.
        """
        for event in self._supervisor.poll():
            raise RiposteError(f"{event.describe}\n{event.tail}")

    def moment(self) -> Moment:
        """Return where the site stands."""
        pids = self.pids
        cpu = {name: sum(psutil.Process(pid).cpu_times()[:2]) for name, pid in pids.items()}
        thread = Path(f"/proc/{pids[LEARNER]}/task/{pids[LEARNER]}/schedstat")
        spent = int(thread.read_text(encoding="ascii").split()[0]) / 1e9
        return Moment(time.monotonic(), cpu, spent, self.newest_checkpoint(), self.totals())

    def resident(self) -> dict[str, int]:
        """Return the bytes of memory each process holds."""
        return {name: psutil.Process(pid).memory_info().rss for name, pid in self.pids.items()}

    def watch(self, seconds: float) -> dict[str, Any]:
        """Return what was done and used in so many seconds, per second."""
        begin = self.moment()
        while time.monotonic() < begin.at + seconds:
            self.check()
            time.sleep(POLL_SECONDS)
        return used_between(begin, self.moment(), self.crowd) | {"resident": self.resident()}

    def stop(self) -> None:
        """End all processes."""
        self._supervisor.stop()


def used_between(begin: Moment, end: Moment, crowd: Crowd) -> dict[str, Any]:
    """Return what was done and used between two moments, per second of wall clock."""
    wall = end.at - begin.at
    samples = crowd.num_envs * 40
    rates: dict[str, float] = {}
    for name in ("accepted", "dropped", "put", "held_back", "bytes_out", "asks"):
        rates[name] = sum(
            (getattr(last, name) - getattr(first, name)) / max(last.at - first.at, 1e-9)
            for first, last in zip(begin.totals, end.totals, strict=True)
        )
    cpu = {name: (end.cpu[name] - begin.cpu[name]) / wall for name in end.cpu}
    thread = (end.learner_thread - begin.learner_thread) / wall
    return {
        "actors": crowd.actors,
        "batch_samples": crowd.batch_samples,
        "rollout_samples": samples,
        "updates": crowd.updates,
        "wall_s": wall,
        "samples_per_s": rates["accepted"] * samples,
        "offered_per_s": crowd.rollouts_per_s * samples,
        "dropped_per_s": rates["dropped"] * samples,
        "held_back_per_s": rates["held_back"],
        "put_per_s": rates["put"] * samples,
        "bytes_out_per_s": rates["bytes_out"],
        "versions_per_s": (end.version - begin.version) / wall,
        "router": cpu["router-0"],
        "league": cpu["league-0"],
        "learner": cpu[LEARNER],
        "learner_thread": thread,
        "learner_threads": cpu[LEARNER] - thread,
        "other_learner": cpu["learner-protagonist"],
        "hosts": sum(used for name, used in cpu.items() if name.startswith("host-")),
    }


@contextlib.contextmanager
def scaling_site(crowd: Crowd, rollout: Path) -> Iterator[ScalingSite]:
    """Run a site, in a folder of its own, until the block ends.

    Args:
        crowd: its actors.
        rollout: file of the recorded rollout that they send.
    """
    folder = Path(tempfile.mkdtemp(prefix="riposte-scale-"))
    samples = crowd.batch_samples
    settings = Settings.load(
        None,
        [
            *ENDLESS, *OVER_SOCKETS, f"learner.batch_samples={samples}",
            f"learner.warm_up_samples={samples}", f"actor.num_envs={crowd.num_envs}",
        ],
    )  # fmt: skip
    (folder / "config.toml").write_text(settings.to_toml(), encoding="utf-8")
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    specs = [
        spec
        for spec in processes(settings, folder, folder.name, endpoint)
        if not spec.name.startswith("actor-")
    ]
    if not crowd.updates:
        specs = [_untaught(spec) for spec in specs]
    specs += _hosts(crowd, rollout, folder, endpoint)
    site = ScalingSite(specs, folder, crowd)
    try:
        yield site
    finally:
        site.stop()
        shutil.rmtree(folder, ignore_errors=True)


def _untaught(spec: ProcessSpec) -> ProcessSpec:
    """Return a learner's process without PPO; any other as it is."""
    if not spec.name.startswith("learner-"):
        return spec
    at = spec.argv.index("-m") + 1
    argv = (*spec.argv[:at], "benchmarks.scaling.untaught", *spec.argv[at:])
    return dataclasses.replace(spec, argv=argv)


def _hosts(crowd: Crowd, rollout: Path, folder: Path, endpoint: str) -> list[ProcessSpec]:
    """Return the processes that the synthetic actors share."""
    specs: list[ProcessSpec] = []
    for number in range(crowd.hosts):
        share = crowd.actors // crowd.hosts + (number < crowd.actors % crowd.hosts)
        if not share:
            continue
        name = f"host-{number}"
        argv = (
            sys.executable, "-P", "-m", "benchmarks.scaling.synthetic", "--connect", endpoint,
            "--run-id", folder.name, "--name", name, "--actors", f"{share}",
            "--rollout", f"{rollout}", "--period", f"{crowd.period}",
            "--out", f"{folder / name}.jsonl",
        )  # fmt: skip
        specs.append(ProcessSpec(name, argv, stop_seconds=0.5))
    return specs
