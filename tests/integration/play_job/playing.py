"""`riposte play` as a person starts it: a process of its own, real services, a real bus."""

import contextlib
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from services.jobs.status import read_endpoint
from shared.bus.base import Bus
from shared.bus.config import BusConfig
from shared.bus.zenoh import open_zenoh
from shared.clock import SystemClock
from shared.messages.play import BatStates, GateState, RefereeState
from shared.messages.topics import BATS, GATE, REFEREE
from tests.integration.training.training import ROOT, log_of, processes_of

X = TypeVar("X")
QUICK = (
    "play.record=false", "play.rest=0.0", "safety.ramp=0.5", "safety.command_hold=0.5",
    "safety.tracker_hold=0.5", "safety.state_hold=0.5", "policy.stale_after=1.0",
    "policy.referee_silence=2.0", "robot_io.referee_silence=2.0", "referee.stale_after=1.0",
    "referee.void_after=10.0",
)  # fmt: skip
"""A match on a machine that tests keep busy."""


class Playing:
    """A match that goes on, and what it wrote to the terminal."""

    def __init__(self, folder: Path, process: "subprocess.Popen[str]", said: Path) -> None:
        self.folder = folder
        self.process = process
        self._said = said

    @property
    def said(self) -> str:
        return self._said.read_text()

    def until(self, condition: Callable[[], X], seconds: float = 60.0) -> X:
        deadline = time.monotonic() + seconds
        while not (value := condition()):
            assert self.process.poll() is None, f"the match ended: {self.said}"
            assert time.monotonic() < deadline, f"waited in vain: {self.said}"
            time.sleep(0.02)
        return value

    def finish(self, seconds: float = 60.0) -> tuple[int, str]:
        code = self.process.wait(seconds)
        return code, self.said

    def pid(self, name: str) -> int:
        """Return the id of a process of the match, as its log says."""
        found = [
            event for event in log_of(self.folder, "play")
            if event.get("process") == name and "started" in event["event"]
        ]  # fmt: skip
        return int(found[-1]["pid"])

    def kill(self, name: str) -> None:
        os.kill(self.pid(name), signal.SIGKILL)

    @property
    def summary(self) -> dict[str, Any]:
        return json.loads((self.folder / "summary.json").read_bytes())

    def is_endpoint_there(self) -> bool:
        return (self.folder / "endpoint.json").exists()


@contextlib.contextmanager
def playing(
    folder: Path, *words: str, overrides: tuple[str, ...] = QUICK,
    environment: Mapping[str, str] | None = None,
) -> Iterator[Playing]:  # fmt: skip
    """Start a match, and leave no process of it behind."""
    command = [sys.executable, "-m", "services.cli", "play", "--out", str(folder), *words]
    command += [word for override in overrides for word in ("--set", override)]
    said = folder.with_suffix(".out")
    with said.open("w") as output:
        process = subprocess.Popen(
            command, cwd=ROOT, stdin=subprocess.DEVNULL, stdout=output, stderr=subprocess.STDOUT,
            text=True, env={**os.environ, **(environment or {})},
        )  # fmt: skip
    try:
        yield Playing(folder, process, said)
    finally:
        process.kill()
        process.wait()
        for pid in processes_of(folder):
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)


class Onlooker:
    """Somebody else on the bus of a match."""

    def __init__(self, match: Playing, bus: Bus) -> None:
        self._match = match
        self.bus = bus
        self._bats = self.bus.subscribe(BATS)
        self._gates = self.bus.subscribe(GATE)
        self._said = self.bus.subscribe(REFEREE)
        self.states: list[BatStates] = []
        self.gates: list[GateState] = []
        self.referee: list[RefereeState] = []

    def listen(self) -> None:
        self.bus.wait(0.02)
        while (states := self._bats.take()) is not None:
            self.states.append(states)
        while (gate := self._gates.take()) is not None:
            self.gates.append(gate)
        while (said := self._said.take()) is not None:
            self.referee.append(said)

    def until(self, condition: Callable[[], X], seconds: float = 60.0) -> X:
        def listening() -> X:
            self.listen()
            return condition()

        return self._match.until(listening, seconds)

    def rest(self, seconds: float) -> None:
        deadline = time.monotonic() + seconds
        self.until(lambda: time.monotonic() >= deadline, seconds + 5.0)

    @property
    def mode(self) -> str:
        return self.gates[-1].mode if self.gates else ""

    @property
    def phase(self) -> str:
        return self.referee[-1].phase if self.referee else ""

    def travel(self, begin: int) -> float:
        """Return how far the robot's tool got from where it was at the index (m)."""
        tools = np.array([states.tools[1, :3] for states in self.states[begin:]])
        return float(np.linalg.norm(tools - tools[0], axis=1).max())

    def is_fencing(self) -> bool:
        """Return whether a bout runs, in which the robot moves."""
        if self.phase != "running" or self.mode != "armed" or len(self.states) < 30:
            return False
        return self.referee[-1].seconds > 0.3 and self.travel(-30) > 0.01


@contextlib.contextmanager
def onlooking(match: Playing) -> Iterator[Onlooker]:
    match.until(match.is_endpoint_there)
    place = read_endpoint(match.folder)
    cfg = BusConfig(connect=(place.connect,), open_seconds=60.0)
    with contextlib.closing(open_zenoh(cfg, "onlooker", SystemClock(), place.run)) as bus:
        yield Onlooker(match, bus)
