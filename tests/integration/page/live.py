"""A site to play on: router, robot_io with the mouse, referee, policy and page as processes."""

import json
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

from shared.bus.base import Bus
from shared.bus.config import BusConfig
from shared.bus.ports import free_port
from shared.bus.zenoh import open_zenoh
from shared.clock import SystemClock
from shared.messages.play import BatStates, RefereeState
from shared.messages.topics import BATS, REFEREE

ROOT = Path(__file__).resolve().parents[3]
X = TypeVar("X")


class LiveSite:
    """The processes of a live bout with a page, and a seat on their bus."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.endpoint = f"tcp/127.0.0.1:{free_port()}"
        self._run = ("--run", str(folder), "--run-id", "live")
        self.processes: dict[str, subprocess.Popen[bytes]] = {}
        self._start("router", "-m", "services.router", *self._run, "--listen", self.endpoint)
        self.bus: Bus = open_zenoh(
            BusConfig(connect=(self.endpoint,)), "watcher", SystemClock(), "live"
        )
        self._bats = self.bus.subscribe(BATS)
        self._referee = self.bus.subscribe(REFEREE)
        self.bats: list[BatStates] = []
        self.referee: list[RefereeState] = []

    def service(
        self, module: str, *words: str, stderr: int | None = None
    ) -> "subprocess.Popen[bytes]":
        return self._start(
            module, "-m", f"services.{module}", *self._run, "--connect", self.endpoint, *words,
            stderr=stderr,
        )  # fmt: skip

    def page(self, *overrides: str) -> str:
        """Start the page on a free port; return its address once it is served."""
        settings = [word for one in ("page.port=0", *overrides) for word in ("--set", one)]
        self.service("page", *settings)
        file = self.folder / "page.json"
        self.until(file.exists)
        return json.loads(file.read_bytes())["url"]

    def kill(self, module: str) -> None:
        process = self.processes.pop(module)
        process.kill()
        process.wait()

    def _start(
        self, name: str, *words: str, stderr: int | None = None
    ) -> "subprocess.Popen[bytes]":
        process = subprocess.Popen([sys.executable, *words], cwd=ROOT, stderr=stderr)
        self.processes[name] = process
        return process

    def listen(self) -> None:
        self.bus.wait(0.01)
        while (bats := self._bats.take()) is not None:
            self.bats.append(bats)
        while (state := self._referee.take()) is not None:
            self.referee.append(state)

    def until(self, condition: Callable[[], X], seconds: float = 30.0) -> X:
        deadline = time.monotonic() + seconds
        while not (value := condition()):
            assert time.monotonic() < deadline, f"not within {seconds} s: {self.referee[-1:]}"
            self.listen()
        return value

    def close(self) -> None:
        self.bus.close()
        for process in reversed(self.processes.values()):
            process.kill()
            process.wait()
