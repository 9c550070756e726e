"""How soon a run learns, how soon each process is up, and what it then holds in memory.

The command is ``riposte train`` itself, in a folder of its own, stopped once it is warm. The
limit is what cannot be saved: a bare Python that imports the learner's libraries.
"""

import datetime
import json
import os
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import psutil

from benchmarks.harness import ROOT, median
from benchmarks.training_run import RunReader
from services.jobs.bench import Check, Measurement
from shared.errors import RiposteError
from shared.runtime.process import THREAD_LIMITS

QUESTION = "seconds from the command to the first update; start-up and memory of each process"
FIRST_UPDATE_GOAL = 15.0
HELP_GOAL = 0.5
ACTOR_GOAL_MB = 200.0
ROLES = ("router", "league", "learner", "actor", "recorder")
FIRST_UPDATE = 2
"""The version it makes: 0 is fresh, 1 has only seen the normaliser's warm-up."""
DEADLINE = 300.0
BARE_IMPORT = "import torch, tensordict, rsl_rl.algorithms, rsl_rl.models, mujoco, zenoh"


def seconds_of(*args: str) -> float:
    """Return how long this interpreter runs with these arguments."""
    begin = time.perf_counter()
    subprocess.run(
        [sys.executable, *args], cwd=ROOT, env=os.environ | THREAD_LIMITS,
        stdout=subprocess.DEVNULL, check=True, timeout=DEADLINE,
    )  # fmt: skip
    return time.perf_counter() - begin


def first_update(warm_seconds: float) -> dict[str, Any]:
    """Return what one `riposte train` took to start, and the memory it held while it ran on."""
    with tempfile.TemporaryDirectory(prefix="riposte-bench-", ignore_cleanup_errors=True) as folder:
        run = RunReader(Path(folder) / "run")
        began_at, began = time.perf_counter(), datetime.datetime.now(datetime.UTC)
        command = [sys.executable, "-P", "-m", "services.cli", "train", "--out", str(run.folder)]
        with (Path(folder) / "output").open("wb") as output:
            process = subprocess.Popen(command, cwd=ROOT, stdout=output, stderr=subprocess.STDOUT)
        try:
            while run.newest_checkpoint() < FIRST_UPDATE:
                if process.poll() is not None or time.perf_counter() - began_at > DEADLINE:
                    raise RiposteError(f"no update: {(Path(folder) / 'output').read_text()[-500:]}")
                time.sleep(0.02)
            seconds = time.perf_counter() - began_at
            memory = peak_memory(process.pid, warm_seconds)
            started = started_after(run.folder / "logs", began)
        finally:
            process.send_signal(signal.SIGINT)
            process.wait(60)
    return {"ratio": seconds, "first_update_s": seconds, "memory_mb": memory, "started_s": started}


def peak_memory(parent: int, seconds: float) -> dict[str, float]:
    """Return the most memory (MB) each process below ``parent`` held within some seconds."""
    most: dict[str, float] = {}
    end = time.perf_counter() + seconds
    while time.perf_counter() < end:
        for child in psutil.Process(parent).children():
            words = child.cmdline()
            if "--name" in words:
                name = words[words.index("--name") + 1]
                most[name] = max(most.get(name, 0.0), child.memory_info().rss / 1e6)
        time.sleep(0.25)
    return most


def started_after(logs: Path, began: datetime.datetime) -> dict[str, float]:
    """Return after how many seconds each service said that it had started."""
    found: dict[str, float] = {}
    for path in logs.glob("*.jsonl"):
        for line in path.read_text(encoding="utf-8").splitlines():
            event = json.loads(line)
            if event.get("event") in ("service_started", "router_started"):
                at = datetime.datetime.fromisoformat(event["timestamp"])
                found.setdefault(path.stem, (at - began).total_seconds())
    return found


def measure(smoke: bool) -> Measurement:
    """Return start-up time and memory."""
    rounds = 1 if smoke else 5
    helps = [seconds_of("-P", "-m", "services.cli", "--help") for _ in range(rounds)]
    imports = {
        role: statistics.median(
            seconds_of("-P", "-c", f"import services.{role}.__main__") for _ in range(rounds)
        )
        for role in ROLES
    }
    bare: list[float] = []
    runs: list[dict[str, Any]] = []
    for _ in range(1 if smoke else 3):
        bare.append(seconds_of("-P", "-c", BARE_IMPORT))
        runs.append(first_update(1.0 if smoke else 20.0))
    names = sorted(set.intersection(*(set(run["memory_mb"]) for run in runs)))
    memory = {name: max(run["memory_mb"][name] for run in runs) for name in names}
    return Measurement(
        value=median(runs, "first_update_s"),
        unit="s to the first update",
        limit=statistics.median(bare),
        ratio=Check(
            name="from the command to the first learner update", value=median(runs, "ratio"),
            unit="s", goal=FIRST_UPDATE_GOAL, goal_is="at most",
        ),
        runs=tuple(runs),
        checks=(
            Check(
                name="riposte --help", value=statistics.median(helps), unit="s", goal=HELP_GOAL,
                goal_is="at most",
            ),
            *(
                Check(
                    name=f"memory of {name}", value=memory[name], unit="MB", goal_is="at most",
                    goal=ACTOR_GOAL_MB if name.startswith("actor") else None,
                )
                for name in names
            ),
            *(Check(name=f"import of {role}", value=imports[role], unit="s") for role in ROLES),
        ),
    )  # fmt: skip
