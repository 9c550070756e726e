"""Plays the sessions of a rehearsal, several at a time, each in a process of its own."""

import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import IO, Any, Final

import msgspec

import services
from shared.errors import RiposteError
from shared.runtime.build import SOURCE_ROOT
from shared.runtime.process import end
from shared.study.allocation import participant_name
from shared.study.folder import Study
from shared.study.journal import FILE
from shared.study.steps import Step

POLL_SECONDS: Final = 1.0
END_SECONDS: Final = 5.0
"""Longest wait for a process that was told to end."""
_WEIGHTS: Final = {"game": 10.0, "warm_up": 10.0, "explore": 30.0, "baseline": 8.0}
"""About how long a kind of step takes to be worked off, next to the others."""
ONE_THREAD: Final = dict.fromkeys(
    ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1"
)
_LAUNCH: Final = Path(services.__file__).with_name("launch.py")


class Standing(msgspec.Struct, frozen=True, kw_only=True):
    """How far the rehearsal is."""

    done: int
    """Sessions that are over."""
    people: int
    share: float
    """Of all the work, in [0, 1]."""
    seconds: float
    """Since it was begun, or taken up again."""
    seconds_left: float | None
    """None while that cannot be told."""
    playing: tuple[str, ...]
    """Who plays now, and what: ``sub-03 s1-g04``."""


class Crew:
    """The processes, and what they have done."""

    def __init__(self, study: Study, people: int, processes: int) -> None:
        """Look at what is there already.

        Args:
            study: with its orders.
            people: how many play.
            processes: at the same time.
        """
        self._study = study
        self._processes = processes
        self._names = [participant_name(number) for number in range(1, people + 1)]
        self._steps = {name: study.steps_of(name) for name in self._names}
        self._running: dict[int, subprocess.Popen[bytes]] = {}
        self._said: dict[int, IO[bytes]] = {}
        """What each process writes to its standard error."""
        self._read: dict[str, tuple[int, list[dict[str, Any]]]] = {}
        """Size and lines of each journal, as read last."""
        self._waiting = [k for k, name in enumerate(self._names, 1) if not self._is_over(name)]
        self._at_first = 0.0
        self._began_at = 0.0
        self.cpu_seconds = 0.0
        """Of the processes that have ended."""

    def run(self, show: Callable[[Standing], None]) -> None:
        """Play all sessions that are not over.

        Args:
            show: is told now and then how far it is.

        Raises:
            RiposteError: a session could not be played; the others that were over are kept.
        """
        before = os.times()
        self._began_at, self._at_first = time.monotonic(), self._share()
        try:
            while self._waiting or self._running:
                while self._waiting and len(self._running) < self._processes:
                    number = self._waiting.pop(0)
                    self._running[number] = self._start(number)
                time.sleep(POLL_SECONDS)
                self._reap()
                if self._running:
                    show(self._standing())
        finally:
            self._stop()
        after = os.times()
        self.cpu_seconds = (after.children_user + after.children_system) - (
            before.children_user + before.children_system
        )
        show(self._standing())

    def _start(self, number: int) -> subprocess.Popen[bytes]:
        command = [
            sys.executable, "-I", "-S", str(_LAUNCH), str(os.getpid()), sys.executable, "-m",
            "services.jobs.study.rehearsal_session", str(self._study.folder), str(number),
        ]  # fmt: skip
        path = os.pathsep.join(filter(None, (str(SOURCE_ROOT), os.environ.get("PYTHONPATH"))))
        said = self._said[number] = tempfile.TemporaryFile()  # noqa: SIM115 (closed in _reap)
        return subprocess.Popen(
            command, stdout=subprocess.DEVNULL, stderr=said,
            env={**os.environ, "PYTHONPATH": path, **ONE_THREAD},
        )  # fmt: skip

    def _reap(self) -> None:
        for number, process in list(self._running.items()):
            if process.poll() is None:
                continue
            del self._running[number]
            with self._said.pop(number) as file:
                file.seek(0)
                said = file.read().decode(errors="replace")
            name = self._names[number - 1]
            if process.returncode != 0 or not self._is_over(name):
                last = said.strip().splitlines()[-1:] or ["it said nothing"]
                raise RiposteError(
                    f"the session of {name} could not be rehearsed (exit {process.returncode}): "
                    f"{last[0]}"
                )

    def _stop(self) -> None:
        end(self._running.values(), END_SECONDS)
        for file in self._said.values():
            file.close()

    def _standing(self) -> Standing:
        share, passed = self._share(), time.monotonic() - self._began_at
        gained = share - self._at_first
        left = passed * (1.0 - share) / gained if gained > 0.01 else None
        return Standing(
            done=sum(self._is_over(name) for name in self._names),
            people=len(self._names),
            share=share,
            seconds=passed,
            seconds_left=left,
            playing=tuple(
                f"{self._names[number - 1]} {self._last(self._names[number - 1])}"
                for number in sorted(self._running)
            ),
        )

    def _share(self) -> float:
        done = total = 0.0
        for name, steps in self._steps.items():
            over = {str(line.get("step")) for line in self._lines(name) if _is(line, "step_done")}
            total += sum(map(_weight, steps))
            done += sum(_weight(step) for step in steps if step.id in over)
        return done / max(total, 1.0)

    def _is_over(self, name: str) -> bool:
        return any(_is(line, "session_ended") for line in self._lines(name)[-3:])

    def _last(self, name: str) -> str:
        return next((str(line["step"]) for line in self._lines(name)[::-1] if line.get("step")), "")

    def _lines(self, name: str) -> list[dict[str, Any]]:
        """Return the whole lines of a journal that another process may be writing."""
        path = self._study.session_folder(name) / FILE
        try:
            size = path.stat().st_size
            if (known := self._read.get(name)) is not None and known[0] == size:
                return known[1]
            text = path.read_bytes()
        except FileNotFoundError:
            return []
        lines = [json.loads(line) for line in text.split(b"\n")[:-1]]
        self._read[name] = (len(text), lines)
        return lines


def _weight(step: Step) -> float:
    return _WEIGHTS.get(step.kind, 1.0)


def _is(line: dict[str, Any], kind: str) -> bool:
    return line["what"]["type"] == kind
