"""How soon a run learns and what its processes hold: a real `riposte train`, from outside.

Start-up of a service is from its process's start to ``service_started`` in its log (imports,
model, session), memory what is resident once the run has learned for a while, router to recorder.
"""

import contextlib
import datetime
import json
import shutil
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import psutil

from benchmarks.harness import ROOT, median, on_first_cores
from services.jobs.bench import Check, Measurement
from services.jobs.runs import state_of
from shared.errors import ConfigError, LedgerError, RiposteError

QUESTION = "start-up time and memory of each process, and seconds to the first learner update"
FIRST_UPDATE_GOAL = 15.0
ACTOR_MB_GOAL = 150.0
HELP_GOAL = 0.5
DEADLINE = 180.0
"""Longest wait for an update on a busy machine (s)."""
STARTED = ("service_started", "router_started")
"""Logged when a service's parts are made and it begins to tick."""
POLL_SECONDS = 0.02
ENDLESS = ("league.antagonist_updates=1000000", "league.convergence_min_updates=0")


def help_seconds() -> float:
    """Return how long ``riposte --help`` takes."""
    begin = time.perf_counter()
    command = [sys.executable, "-P", "-m", "services.cli", "--help"]
    subprocess.run(command, cwd=ROOT, check=True, stdout=subprocess.DEVNULL, timeout=60)
    return time.perf_counter() - begin


def run_once(updates: int) -> dict[str, Any]:
    """Return what one run took to learn, and what its processes held after some updates."""
    folder = Path(tempfile.mkdtemp(prefix="riposte-start-")) / "run"
    with _train(folder) as train:
        began_at = time.time_ns()
        first = _wait_for_updates(train, folder, 1)
        _wait_for_updates(train, folder, updates)
        children = psutil.Process(train.pid).children(recursive=True)
        processes = {_name(process): process for process in children}
        memory = {name: p.memory_info() for name, p in sorted(processes.items())}
        started = {
            name: at - p.create_time()
            for name, p in sorted(processes.items())
            if (at := _logged_at(folder, name, STARTED))
        }
        memory["train"] = psutil.Process(train.pid).memory_info()
        resident = {name: found.rss / 1e6 for name, found in memory.items()}
        own = {name: (found.rss - found.shared) / 1e6 for name, found in memory.items()}
    return {
        "first_update_s": (first - began_at) / 1e9,
        "ratio": (first - began_at) / 1e9,
        "started_s": started,
        "resident_mb": resident,
        "own_mb": own,
        "actor_mb": max(mb for name, mb in resident.items() if name.startswith("actor")),
        "total_mb": sum(resident.values()),
    }


@contextlib.contextmanager
def _train(folder: Path) -> Iterator[subprocess.Popen[bytes]]:
    """Run ``riposte train``, one endless stage, until the block ends."""
    command = [sys.executable, "-P", "-m", "services.cli", "train", "--out", str(folder)]
    for override in ENDLESS:
        command += ["--set", override]
    process = subprocess.Popen(
        command, cwd=ROOT, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    try:
        yield process
    finally:
        process.send_signal(signal.SIGINT)
        try:
            process.wait(60.0)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        shutil.rmtree(folder.parent, ignore_errors=True)


def _wait_for_updates(train: subprocess.Popen[bytes], folder: Path, updates: int) -> int:
    """Return when (wall clock, ns) the antagonist's so-many-th update was in the ledger."""
    end = time.monotonic() + DEADLINE
    while time.monotonic() < end:
        if train.poll() is not None:
            raise RiposteError(f"riposte train ended with {train.returncode}: see {folder}")
        learned = _updates(folder)
        if len(learned) >= updates:
            return learned[updates - 1]
        time.sleep(POLL_SECONDS)
    raise RiposteError(f"no update {updates} within {DEADLINE:g} s: see {folder / 'logs'}")


def _updates(folder: Path) -> list[int]:
    """Return when each version that PPO made was entered; the warm-up's is none."""
    try:
        state = state_of(folder)
    except (ConfigError, LedgerError):  # not there yet, or being made
        return []
    return [v.at_ns for stage in state.stages for v in stage.versions if v.metrics is not None]


def _name(process: psutil.Process) -> str:
    """Return what a process is called in the run; the kernel keeps 15 letters of it."""
    words = process.cmdline()
    return words[words.index("--name") + 1] if "--name" in words else process.name()


def _logged_at(folder: Path, name: str, events: Sequence[str]) -> float:
    """Return when (wall clock, s) a process logged one of these first; 0 when it did not."""
    path = folder / "logs" / f"{name}.jsonl"
    if path.exists():
        for line in path.read_text(encoding="utf-8").splitlines():
            found = json.loads(line)
            if found.get("event") in events:
                return datetime.datetime.fromisoformat(found["timestamp"]).timestamp()
    return 0.0


def measure(smoke: bool) -> Measurement:
    """Return seconds to the first update, and start-up and memory of each process."""
    helps = [help_seconds() for _ in range(2 if smoke else 10)]
    with on_first_cores(2):
        runs = tuple(run_once(2 if smoke else 30) for _ in range(1 if smoke else 5))

    def middle(of: str, name: str) -> float:
        return statistics.median(run[of][name] for run in runs)

    services = list(runs[0]["started_s"])
    return Measurement(
        value=median(runs, "first_update_s"),
        unit="s from the command to the first update",
        limit=FIRST_UPDATE_GOAL,
        ratio=Check(
            name="first learner update", value=median(runs, "ratio"), unit="s",
            goal=FIRST_UPDATE_GOAL, goal_is="at most",
        ),
        runs=runs,
        checks=(
            Check(
                name="riposte --help", value=statistics.median(helps), unit="s", goal=HELP_GOAL,
                goal_is="at most",
            ),
            Check(
                name="actor, resident", value=max(run["actor_mb"] for run in runs), unit="MB",
                goal=ACTOR_MB_GOAL, goal_is="at most",
            ),
            *(
                Check(name=f"{name} ready after", value=middle("started_s", name), unit="s")
                for name in services
            ),
            *(
                Check(name=f"{name}, resident", value=middle("resident_mb", name), unit="MB")
                for name in sorted(runs[0]["resident_mb"])
            ),
            Check(name="all processes, resident", value=median(runs, "total_mb"), unit="MB"),
        ),
        details={"help_s": helps},
    )  # fmt: skip
