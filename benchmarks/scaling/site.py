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
from benchmarks.training_run import ENDLESS, UNTAUGHT, RunReader, wrapped
from services.jobs.settings import Settings
from services.jobs.train.command import processes
from services.league.config import LeagueConfig
from services.supervisor import ProcessSpec, Supervisor
from shared.bus.ports import free_port
from shared.clock import SystemClock
from shared.errors import RiposteError

START_SECONDS = 400.0
POLL_SECONDS = 0.2
LEARNER = "learner-antagonist"
ROLLOUT_STEPS = 40
LEASE_SECONDS = LeagueConfig().lease_seconds
OVER_SOCKETS = ("bus.shared_memory=false", "train.record=false", "recorder.live=false")


@dataclasses.dataclass(frozen=True)
class Setup:
    """What a site's learner is for."""

    name: str
    batch_rollouts: int
    """In one update."""
    num_envs: int
    """Bouts in a rollout of 40 steps."""
    updates: bool = False
    """Whether the learner runs PPO."""

    @property
    def rollout_samples(self) -> int:
        """Return the samples in one rollout."""
        return self.num_envs * ROLLOUT_STEPS

    @property
    def batch_samples(self) -> int:
        """Return the samples in one update."""
        return self.batch_rollouts * self.rollout_samples


@dataclasses.dataclass(frozen=True)
class Crowd:
    """Which synthetic actors a site has."""

    actors: int
    rollouts_per_s: float
    """Offered by all of them together; 0: as many as are acknowledged."""
    hosts: int = 2
    """Processes they share."""

    @property
    def period(self) -> float:
        """Return the seconds between two rollouts of one actor."""
        return self.actors / self.rollouts_per_s if self.rollouts_per_s else 0.0


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
    """Router, league and learners, all running, and at most one crowd of synthetic actors."""

    def __init__(
        self, specs: list[ProcessSpec], folder: Path, setup: Setup, endpoint: str, rollout: Path,
        lease_seconds: float,
    ) -> None:  # fmt: skip
        super().__init__(folder)
        self.setup = setup
        self.endpoint = endpoint
        self.crowd = Crowd(0, 0.0)
        self.sample_bytes = rollout.stat().st_size / setup.rollout_samples
        self._rollout = rollout
        self._lease_seconds = lease_seconds
        self._crowds = 0
        self._supervisor = Supervisor(specs, folder / "logs", SystemClock())
        self._hosts = Supervisor([], folder / "logs", SystemClock())
        self._supervisor.start()

    @property
    def pids(self) -> dict[str, int]:
        """Return the process ids by name."""
        return self._supervisor.pids | self._hosts.pids

    def populate(self, crowd: Crowd) -> None:
        """Put a crowd in the place of the one before, and wait until it is at work.

        Raises:
            RiposteError: a process died, or it took too long.
        """
        if self.crowd.actors:
            self._hosts.stop()
            time.sleep(LEASE_SECONDS + 2.0)  # its leases lapse
        self._crowds += 1
        self.crowd = crowd
        self._hosts = Supervisor(self._specs(crowd), self.folder / "logs", SystemClock())
        self._hosts.start()
        self._until_busy()

    def _specs(self, crowd: Crowd) -> list[ProcessSpec]:
        """Return the processes that the synthetic actors share."""
        specs: list[ProcessSpec] = []
        for number in range(min(crowd.hosts, crowd.actors)):
            share = crowd.actors // crowd.hosts + (number < crowd.actors % crowd.hosts)
            name = f"host-{self._crowds}-{number}"
            argv = (
                sys.executable, "-P", "-m", "benchmarks.scaling.synthetic",
                "--connect", self.endpoint, "--run-id", self.folder.name, "--name", name,
                "--actors", f"{share}", "--rollout", f"{self._rollout}",
                "--period", f"{crowd.period}", "--link-lease", f"{self._lease_seconds}",
                "--out", f"{self.folder / name}.jsonl",
            )  # fmt: skip
            specs.append(ProcessSpec(name, argv, stop_seconds=0.5))
        return specs

    def totals(self) -> list[Totals]:
        """Return the newest totals of each host that has any."""
        found: list[Totals] = []
        for path in sorted(self.folder.glob(f"host-{self._crowds}-*.jsonl")):
            lines = path.read_bytes().splitlines(keepends=True)
            whole = [line for line in lines if line.endswith(b"\n")]
            if whole:
                found.append(msgspec.json.decode(whole[-1], type=Totals))
        return found

    def _until_busy(self) -> None:
        """Wait until every actor has a lease and the learner makes versions from their rollouts."""
        end, first = time.monotonic() + START_SECONDS, max(self.newest_checkpoint(), 0)
        while time.monotonic() < end:
            self.check()
            leased = sum(totals.leased for totals in self.totals())
            if leased == self.crowd.actors and self.newest_checkpoint() >= first + 2:
                return
            time.sleep(POLL_SECONDS)
        raise RiposteError(
            f"{sum(totals.leased for totals in self.totals())} of {self.crowd.actors} actors had a "
            f"lease after {START_SECONDS:g} s, version {self.newest_checkpoint()}"
        )

    def check(self) -> None:
        """Look after the processes.

        Raises:
            RiposteError: one of them died.
        """
        for event in (*self._supervisor.poll(), *self._hosts.poll()):
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
        return used_between(begin, self.moment(), self.setup, self.crowd) | {
            "resident": self.resident()
        }

    def stop(self) -> None:
        """End all processes."""
        self._hosts.stop()
        self._supervisor.stop()


def used_between(begin: Moment, end: Moment, setup: Setup, crowd: Crowd) -> dict[str, Any]:
    """Return what was done and used between two moments, per second of wall clock."""
    wall = end.at - begin.at
    samples = setup.rollout_samples
    rates: dict[str, float] = {}
    for name in ("accepted", "dropped", "put", "held_back", "bytes_out", "asks"):
        rates[name] = sum(
            (getattr(last, name) - getattr(first, name)) / max(last.at - first.at, 1e-9)
            for first, last in zip(begin.totals, end.totals, strict=True)
        )
    cpu = {name: (end.cpu[name] - begin.cpu[name]) / wall for name in end.cpu}
    thread = (end.learner_thread - begin.learner_thread) / wall
    return {
        "site": setup.name,
        "actors": crowd.actors,
        "batch_samples": setup.batch_samples,
        "rollout_samples": samples,
        "updates": setup.updates,
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
def scaling_site(setup: Setup, rollout: Path, lease_seconds: float = 2.0) -> Iterator[ScalingSite]:
    """Run a site, in a folder of its own, until the block ends.

    Args:
        setup: what its learner is for.
        rollout: file of the recorded rollout that its actors send.
        lease_seconds: after which a silent link is given up.
    """
    folder = Path(tempfile.mkdtemp(prefix="riposte-scale-"))
    samples = setup.batch_samples
    settings = Settings.load(
        None,
        [
            *ENDLESS, *OVER_SOCKETS, f"learner.batch_samples={samples}",
            f"learner.warm_up_samples={samples}", f"actor.num_envs={setup.num_envs}",
            f"bus.lease_seconds={lease_seconds}",
        ],
    )  # fmt: skip
    (folder / "config.toml").write_text(settings.to_toml(), encoding="utf-8")
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    specs = [
        wrapped(spec, UNTAUGHT) if _is_untaught(spec, setup) else spec
        for spec in processes(settings, folder, folder.name, endpoint)
        if not spec.name.startswith("actor-")
    ]
    site = ScalingSite(specs, folder, setup, endpoint, rollout, lease_seconds)
    try:
        yield site
    finally:
        site.stop()
        shutil.rmtree(folder, ignore_errors=True)


def _is_untaught(spec: ProcessSpec, setup: Setup) -> bool:
    """Return whether a process is a learner that is to leave PPO out."""
    return not setup.updates and spec.name.startswith("learner-")
