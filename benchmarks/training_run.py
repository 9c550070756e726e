"""A real training run, as `riposte train` starts it, for benchmarks to look at from outside."""

import contextlib
import dataclasses
import shutil
import tempfile
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import psutil

from services.jobs.runs import state_of
from services.jobs.settings import Settings
from services.jobs.train.command import processes
from services.league.history import VersionRecord
from services.supervisor import ProcessSpec, Supervisor
from shared.bus.ports import free_port
from shared.clock import SystemClock
from shared.errors import ConfigError, LedgerError, RiposteError

POLL_SECONDS = 0.02
START_SECONDS = 180.0
"""Longest wait for the first version on a busy machine."""
ENDLESS = ("league.antagonist_updates=1000000", "league.convergence_min_updates=0")
"""One stage: the antagonist against the frozen first protagonist."""
WARM_VERSION = 4
"""The first version is the normaliser's warm-up, the next few fill the pipeline."""
UNTAUGHT = "benchmarks.scaling.untaught"
"""What a learner is wrapped in to leave PPO out."""


@dataclasses.dataclass(frozen=True)
class Moment:
    """Where a run stood."""

    version: VersionRecord
    at: float
    """When this was noticed, by ``time.monotonic``."""
    cpu_seconds: dict[str, float]
    """Used so far, by process."""
    delay_seconds: float
    """For which threads of theirs were ready to run and had no core."""


class RunReader:
    """What the folder of a run says of it."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def newest_checkpoint(self) -> int:
        """Return the antagonist's newest version on disk; -1 before there is one.

        Cheap, so that whoever waits does not slow down what it measures.
        """
        names = (self.folder / "learner" / "antagonist").glob("checkpoint-*.safetensors")
        return max((int(path.stem.removeprefix("checkpoint-")) for path in names), default=-1)

    def newest_version(self) -> VersionRecord | None:
        """Return the antagonist's newest version in the ledger; None before there is one."""
        try:
            return state_of(self.folder).latest("antagonist")
        except (ConfigError, LedgerError):  # not there yet, or being made
            return None


class TrainingRun(RunReader):
    """The processes of one run; tick them by asking for something."""

    def __init__(self, specs: list[ProcessSpec], folder: Path) -> None:
        super().__init__(folder)
        self._supervisor = Supervisor(specs, folder / "logs", SystemClock())
        self._supervisor.start()

    def wait_for_version(self, number: int, deadline: float = START_SECONDS) -> Moment:
        """Return the moment at which the antagonist's version was in the ledger.

        Raises:
            RiposteError: a process died, or it took longer than the deadline (s).
        """
        end = time.monotonic() + deadline
        while time.monotonic() < end:
            self.check()
            if self.newest_checkpoint() >= number:
                at, cpu, delay = time.monotonic(), self.cpu_seconds(), self.delay_seconds()
                newest = self.newest_version()
                if newest is not None and newest.version >= number:
                    return Moment(newest, at, cpu, delay)
            time.sleep(POLL_SECONDS)
        raise RiposteError(f"no version {number} within {deadline:g} s: see {self.folder / 'logs'}")

    @property
    def pids(self) -> dict[str, int]:
        """Return the process ids by name."""
        return self._supervisor.pids

    def check(self) -> None:
        """Look after the processes.

        Raises:
            RiposteError: one of them died.
        """
        for event in self._supervisor.poll():
            if event.kind != "finished":
                raise RiposteError(f"{event.describe}\n{event.tail}")

    def cpu_seconds(self) -> dict[str, float]:
        """Return the CPU seconds each process has used."""
        return {
            name: sum(psutil.Process(pid).cpu_times()[:2])
            for name, pid in self._supervisor.pids.items()
        }

    def delay_seconds(self) -> float:
        """Return how long their threads were ready to run and had no core."""
        total = 0
        for pid in self._supervisor.pids.values():
            for path in Path(f"/proc/{pid}/task").glob("*/schedstat"):
                with contextlib.suppress(OSError):  # that thread ended just now
                    total += int(path.read_text(encoding="ascii").split()[1])
        return total / 1e9

    def resident_mib(self) -> dict[str, float]:
        """Return the memory each process holds."""
        return {
            name: psutil.Process(pid).memory_info().rss / 2**20
            for name, pid in self._supervisor.pids.items()
        }

    def window(self, seconds: float) -> dict[str, Any]:
        """Return samples and CPU seconds of a stretch between two versions, warm."""
        begin = self.wait_for_version(WARM_VERSION)
        while time.monotonic() < begin.at + seconds:
            self.check()
            time.sleep(0.5)
        end = self.wait_for_version(self.newest_checkpoint() + 1)
        assert begin.version.metrics is not None
        assert end.version.metrics is not None
        samples = end.version.metrics.total_samples - begin.version.metrics.total_samples
        wall = (end.version.at_ns - begin.version.at_ns) / 1e9
        cpu = {name: end.cpu_seconds[name] - begin.cpu_seconds[name] for name in end.cpu_seconds}
        return {
            "samples": samples,
            "samples_per_s": samples / wall,
            "samples_per_cpu_s": samples / sum(cpu.values()),
            "wall_s": wall,
            "cpu_s": sum(cpu.values()),
            "cpu_s_by_process": cpu,
            "delay_s": end.delay_seconds - begin.delay_seconds,
            "began_at": begin.at,
            "ended_at": end.at,
            "update_seconds": end.version.metrics.update_seconds,
            "wait_seconds": end.version.metrics.wait_seconds,
        }

    def stop(self) -> None:
        """End all processes."""
        self._supervisor.stop()


@contextlib.contextmanager
def training_run(
    overrides: Sequence[str] = ENDLESS, wrap: str = "", of: str = ""
) -> Iterator[TrainingRun]:
    """Run a training, in a folder of its own, until the block ends.

    Args:
        overrides: of the default settings.
        wrap: module to put before the services' modules: ``python -m WRAP services.role ...``.
        of: how the names of the processes begin that it is put before; all of them.
    """
    folder = Path(tempfile.mkdtemp(prefix="riposte-bench-"))
    settings = Settings.load(None, ["recorder.live=false", *overrides])
    (folder / "config.toml").write_text(settings.to_toml(), encoding="utf-8")
    specs = processes(settings, folder, folder.name, f"tcp/127.0.0.1:{free_port()}")
    if wrap:
        specs = [wrapped(spec, wrap) if spec.name.startswith(of) else spec for spec in specs]
    run = TrainingRun(specs, folder)
    try:
        yield run
    finally:
        run.stop()
        shutil.rmtree(folder, ignore_errors=True)


def wrapped(spec: ProcessSpec, module: str) -> ProcessSpec:
    """Return a process that runs ``python -P -m MODULE services.role ...``."""
    at = spec.argv.index("-m") + 1
    return dataclasses.replace(spec, argv=(*spec.argv[:at], module, *spec.argv[at:]))
