"""`riposte train` as a person starts it: a process of its own, real services, a real bus."""

import contextlib
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, TypeVar

from services.jobs.runs import state_of
from shared.errors import ConfigError, LedgerError
from tests.integration.small import SMALL

X = TypeVar("X")
ROOT = Path(__file__).resolve().parents[3]


def command(folder: Path, *words: str, overrides: Sequence[str] = SMALL) -> list[str]:
    """Return the command line of a run in a folder."""
    line = [sys.executable, "-m", "services.cli", "train", "--out", str(folder), *words]
    return line + [word for override in overrides for word in ("--set", override)]


@contextlib.contextmanager
def training(
    folder: Path, *words: str, overrides: Sequence[str] = SMALL
) -> Iterator["subprocess.Popen[str]"]:
    """Start a run, and leave no process of it behind."""
    process = subprocess.Popen(
        command(folder, *words, overrides=overrides),
        cwd=ROOT,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        yield process
    finally:
        process.kill()
        process.communicate()
        # Children die with their parent, by the kernel's hand, at once.
        for pid in processes_of(folder):
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)


def finish(process: "subprocess.Popen[str]", seconds: float) -> tuple[int, str, str]:
    """Return exit code, stdout and stderr."""
    out, err = process.communicate(timeout=seconds)
    return process.returncode, out, err


def train(
    folder: Path, *words: str, overrides: Sequence[str] = SMALL, seconds: float = 100.0
) -> tuple[int, str, str]:
    """Run to the end and return exit code, stdout and stderr."""
    with training(folder, *words, overrides=overrides) as process:
        return finish(process, seconds)


def wait_until(
    condition: Callable[[], X], process: "subprocess.Popen[str]", seconds: float = 60.0
) -> X:
    """Return the condition's first true value, while the run goes on."""
    deadline = time.monotonic() + seconds
    while not (value := condition()):
        if process.poll() is not None:
            raise AssertionError(f"the run ended: {process.communicate()}")
        assert time.monotonic() < deadline, "waited in vain"
        time.sleep(0.02)
    return value


def log_of(folder: Path, name: str) -> list[dict[str, Any]]:
    """Return the events one process has logged, all its lives, oldest first."""
    path = folder / "logs" / f"{name}.jsonl"
    if not path.exists():
        return []
    lines = path.read_text().splitlines()
    events: list[dict[str, Any]] = []
    for line in lines:
        with contextlib.suppress(json.JSONDecodeError):  # a line cut short by kill -9
            events.append(json.loads(line))
    return events


def living(folder: Path, name: str) -> int | None:
    """Return the id of a process of the run that has come up, None while there is none."""
    pid: int | None = None
    for event in log_of(folder, name):
        if event["event"] == "service_started":
            pid = event["pid"]
    return pid if pid is not None and pid in processes_of(folder) else None


def processes_of(folder: Path) -> list[int]:
    """Return the ids of all processes that have the folder on their command line."""
    found: list[int] = []
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit() and int(entry.name) != os.getpid():
            with contextlib.suppress(OSError):
                line = (entry / "cmdline").read_bytes()
                if os.fsencode(str(folder)) in line.split(b"\0"):
                    found.append(int(entry.name))
    return found


def updates_of(folder: Path) -> int:
    """Return how many updates the ledger has so far."""
    try:
        return sum(record.updates for record in state_of(folder).stages)
    except (ConfigError, LedgerError):  # not there yet, or just being made
        return 0


def one_line(text: str) -> str:
    """Return the only line there is."""
    lines = text.strip().splitlines()
    assert len(lines) == 1, text
    return lines[0]
