"""Starts processes, restarts those that die, stops them in order.

Single-threaded: whoever owns a ``Supervisor`` calls ``poll`` a few times a second, always from
the thread that called ``start`` and for as long as the processes shall live, because the kernel
kills a process when the *thread* that started it ends.
"""

import contextlib
import dataclasses
import os
import signal
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Literal

from shared.clock import Clock
from shared.errors import RiposteError
from shared.runtime.process import SERVICE_ENVIRONMENT
from shared.runtime.serve import EXIT_BAD_INPUT, EXIT_BUS_LOST

FIRST_DELAY = 0.2
LONGEST_DELAY = 10.0
"""Seconds before a restart: doubled with every quick death in a row."""
QUICK_SECONDS = 5.0
"""A process that lived longer than this starts with a clean record."""
QUICK_DEATHS = 5
"""Quick deaths in a row after which it is given up."""
QUICK_BUS_DEATHS = 20
"""The same for processes that only lost the bus: its router may be on its way back."""
KILL_SECONDS = 10.0
"""From SIGKILL until the others are stopped all the same: a starved machine takes its time."""
TAIL_LINES = 12
TAIL_BYTES = 4096
OUTPUT_BYTES = 1 << 20
"""An output file longer than this begins anew with the next start."""

Kind = Literal["started", "died", "restarted", "finished", "gave_up", "stopped", "killed"]


@dataclasses.dataclass(frozen=True)
class ProcessSpec:
    """One process to keep alive."""

    name: str
    argv: tuple[str, ...]
    restart: bool = True
    """Start it again when it dies."""
    finishes: bool = True
    """Ending with 0 it has finished. A service never has: somebody told it to end who was not its
    supervisor, and the others still need it."""
    stop_seconds: float = 20.0
    """From SIGTERM to SIGKILL."""
    cwd: Path | None = None


@dataclasses.dataclass(frozen=True)
class ProcessEvent:
    """What happened to a process."""

    kind: Kind
    name: str
    pid: int
    restarts: int
    """How often it was started again so far."""
    exit_code: int | None = None
    """Negative: killed by that signal."""
    tail: str = ""
    """The end of what it wrote to stdout and stderr in this life."""
    delay: float = 0.0
    """Seconds until it is started again."""

    @property
    def describe(self) -> str:
        """Return the event in one line."""
        how = "" if self.exit_code is None else f" ({exit_words(self.exit_code)})"
        last = self.tail.splitlines()[-1].strip() if self.tail else ""
        said = f": {last}" if last and self.kind in ("died", "gave_up") else ""
        return f"{self.name} {self.kind.replace('_', ' ')}{how}{said}"


def service_command(
    role: str,
    *,
    name: str,
    run: Path,
    site: Path | None = None,
    run_id: str = "",
    connect: Sequence[str] = (),
    agent: str = "",
    overrides: Sequence[str] = (),
) -> tuple[str, ...]:
    """Return the command line of a service process, independent of the working directory."""
    command = [sys.executable, "-P", "-m", f"services.{role}"]
    command += [str(site.resolve())] if site else []
    command += ["--name", name, "--run", str(run.resolve())]
    command += ["--run-id", run_id] if run_id else []
    command += ["--agent", agent] if agent else []
    for endpoint in connect:
        command += ["--connect", endpoint]
    for override in overrides:
        command += ["--set", override]
    return tuple(command)


def exit_words(code: int) -> str:
    """Return an exit code in words."""
    if code >= 0:
        return f"exit code {code}"
    with contextlib.suppress(ValueError):
        return f"killed by {signal.Signals(-code).name}"
    return f"killed by signal {-code}"


@dataclasses.dataclass
class _Child:
    spec: ProcessSpec
    output: Path
    popen: subprocess.Popen[bytes] | None = None
    started_at: float = 0.0
    output_from: int = 0
    restart_at: float | None = None
    restarts: int = 0
    quick_deaths: int = 0


class Supervisor:
    """Keeps the processes of one machine alive."""

    def __init__(self, processes: Sequence[ProcessSpec], log_dir: Path, clock: Clock) -> None:
        """Take the processes in the order they are started.

        Args:
            processes: names must differ.
            log_dir: each one's stdout and stderr go to ``<name>.out`` in here.
            clock: counts the delays.
        """
        names = [spec.name for spec in processes]
        if len(set(names)) != len(names):
            raise ValueError(f"process names must differ: {', '.join(names)}")
        self._clock = clock
        self._log_dir = log_dir
        self._children = [_Child(spec, log_dir / f"{spec.name}.out") for spec in processes]

    @property
    def pids(self) -> dict[str, int]:
        """Return the process ids of those that run."""
        return {
            child.spec.name: child.popen.pid for child in self._children if child.popen is not None
        }

    @property
    def restarts(self) -> dict[str, int]:
        """Return how often each was started again."""
        return {child.spec.name: child.restarts for child in self._children}

    @property
    def is_needed(self) -> bool:
        """Return whether any process runs or is about to be started again."""
        return any(child.popen or child.restart_at is not None for child in self._children)

    def start(self) -> list[ProcessEvent]:
        """Start all of them, in order.

        Raises:
            RiposteError: a log file cannot be written.
        """
        return [self._start(child) for child in self._children]

    def poll(self) -> list[ProcessEvent]:
        """Note deaths, start again what is due; never blocks."""
        events: list[ProcessEvent] = []
        for child in self._children:
            if child.popen is not None:
                code = child.popen.poll()
                if code is not None:
                    events += self._note_end(child, code)
                else:
                    _bound(child)
            elif child.restart_at is not None and self._clock.now() >= child.restart_at:
                child.restarts += 1
                events.append(self._start(child))
        return events

    def stop(self) -> list[ProcessEvent]:
        """End all of them, the last started first, each killed at its deadline; idempotent."""
        return [event for child in reversed(self._children) for event in self._stop(child)]

    def _start(self, child: _Child) -> ProcessEvent:
        launch = str(Path(__file__).with_name("launch.py"))
        command = [sys.executable, "-I", "-S", launch, str(os.getpid()), *child.spec.argv]
        try:
            self._log_dir.mkdir(parents=True, exist_ok=True)
            with child.output.open("ab") as output:
                if output.tell() > OUTPUT_BYTES:
                    output.truncate(0)
                child.output_from = os.fstat(output.fileno()).st_size
                child.popen = subprocess.Popen(
                    command,
                    stdin=subprocess.DEVNULL,
                    stdout=output,
                    stderr=subprocess.STDOUT,
                    env=os.environ | SERVICE_ENVIRONMENT,
                    cwd=child.spec.cwd,
                    process_group=0,  # Ctrl-C reaches the supervisor alone, which stops in order
                )
        except OSError as error:
            raise RiposteError(f"cannot start {child.spec.name}: {error}") from error
        child.started_at = self._clock.now()
        child.restart_at = None
        return self._event(child, "restarted" if child.restarts else "started", child.popen.pid)

    def _note_end(self, child: _Child, code: int) -> list[ProcessEvent]:
        assert child.popen is not None
        pid, child.popen = child.popen.pid, None
        _signal_group(pid, signal.SIGKILL)  # what it may have left behind
        if code == 0 and child.spec.finishes:
            return [self._event(child, "finished", pid, code)]
        lived = self._clock.now() - child.started_at
        child.quick_deaths = child.quick_deaths + 1 if lived < QUICK_SECONDS else 1
        limit = QUICK_BUS_DEATHS if code == EXIT_BUS_LOST else QUICK_DEATHS
        hopeless = code == EXIT_BAD_INPUT or child.quick_deaths >= limit
        if hopeless or not child.spec.restart:
            return [self._event(child, "died", pid, code), self._event(child, "gave_up", pid, code)]
        delay = min(FIRST_DELAY * 2.0 ** (child.quick_deaths - 1), LONGEST_DELAY)
        child.restart_at = self._clock.now() + delay
        return [self._event(child, "died", pid, code, delay)]

    def _stop(self, child: _Child) -> list[ProcessEvent]:
        child.restart_at = None
        if child.popen is None:
            return []
        popen, child.popen = child.popen, None
        kind: Kind = "stopped"
        _signal_group(popen.pid, signal.SIGTERM)
        try:
            code = popen.wait(child.spec.stop_seconds)
        except subprocess.TimeoutExpired:
            kind = "killed"
            popen.kill()
            code = _wait_for_end(popen)
        _signal_group(popen.pid, signal.SIGKILL)
        return [self._event(child, kind, popen.pid, code)]

    def _event(
        self, child: _Child, kind: Kind, pid: int, code: int | None = None, delay: float = 0.0
    ) -> ProcessEvent:
        tail = "" if code is None else _tail(child.output, child.output_from)
        return ProcessEvent(kind, child.spec.name, pid, child.restarts, code, tail, delay)


def _bound(child: _Child) -> None:
    """Empty the output of a process that has said too much; the process appends to it."""
    with contextlib.suppress(OSError):
        if child.output.stat().st_size > OUTPUT_BYTES:
            os.truncate(child.output, 0)
            child.output_from = 0


def _wait_for_end(popen: subprocess.Popen[bytes]) -> int:
    """Return how a killed process ended; one that the kernel has not let go of yet will."""
    with contextlib.suppress(subprocess.TimeoutExpired):
        return popen.wait(KILL_SECONDS)
    return -signal.SIGKILL


def _signal_group(pid: int, number: signal.Signals) -> None:
    with contextlib.suppress(ProcessLookupError, PermissionError):
        os.killpg(pid, number)


def _tail(path: Path, begin: int) -> str:
    try:
        with path.open("rb") as file:
            size = file.seek(0, os.SEEK_END)
            file.seek(max(begin, size - TAIL_BYTES))
            text = file.read(TAIL_BYTES).decode("utf-8", "replace")
    except OSError:
        return ""
    return "\n".join(text.splitlines()[-TAIL_LINES:])
