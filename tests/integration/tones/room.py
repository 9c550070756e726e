"""A site with a strap and a sound card that are none, and robot_io as a process between them."""

import contextlib
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Generator
from pathlib import Path

import numpy as np
import psutil

from shared.bus.base import Bus
from shared.bus.config import BusConfig
from shared.bus.ports import free_port
from shared.bus.zenoh import open_zenoh
from shared.clock import SystemClock
from shared.messages.live import ServiceStatus
from shared.messages.play import RefereeState
from shared.messages.topics import HEART_RATE, REFEREE, STATUS

ROOT = Path(__file__).resolve().parents[3]
SECONDS = 30.0


class Room:
    """What a test does to it: it is the referee, and reads what robot_io publishes."""

    def __init__(self, bus: Bus, processes: list["subprocess.Popen[bytes]"]) -> None:
        self.bus = bus
        self._processes = processes
        self.robot_io = processes[-1]
        self.beats = bus.subscribe(HEART_RATE)
        self._statuses = bus.subscribe(STATUS, role="robot-io")
        self.status: ServiceStatus | None = None
        self._step = 0

    def say(self, hz: float) -> None:
        """Say that this tone should sound."""
        self._step += 1
        state = RefereeState(
            bout="b", phase="running", antagonist="a", protagonist="p", tick=self._step,
            step=self._step, seconds=0.01 * self._step, score=0.0, points=0.0,
            in_target=np.zeros(2, bool), contact=False, attack_steps=0, penalty_steps=0,
            camping_steps=0, missed_ticks=0, tone_hz=hz,
        )  # fmt: skip
        self.bus.publish(REFEREE, state)

    def sound(self, hz: float, seconds: float) -> float:
        """Say a tone for so long, step by step, then silence; return when it began (s)."""
        began_at = time.monotonic()
        while time.monotonic() < began_at + seconds:
            self.say(hz)
            self.bus.wait(0.01)
            time.sleep(0.01)
        self.say(0.0)
        return began_at

    def players(self) -> list[psutil.Process]:
        """Return the sound processes of robot_io."""
        return psutil.Process(self.robot_io.pid).children()

    def until(self, condition: Callable[[], object], seconds: float = SECONDS) -> None:
        """Wait for a condition, reading the status meanwhile."""
        deadline = time.monotonic() + seconds
        while not condition():
            dead = [process.args for process in self._processes if process.poll() is not None]
            assert not dead, f"died: {dead}"
            assert time.monotonic() < deadline, f"not within {seconds} s: {self.status}"
            self.bus.wait(0.02)
            while (status := self._statuses.take()) is not None:
                self.status = status

    def fresh_status(self) -> ServiceStatus:
        """Return the next status; one comes every second."""
        self.status = None
        self.until(lambda: self.status is not None)
        assert self.status is not None
        return self.status


@contextlib.contextmanager
def room(environment: dict[str, str], *settings: str) -> Generator[Room]:
    """Run a router and robot_io; yield the way to them.

    Args:
        environment: for robot_io, over this process's own.
        settings: ``section.key=value`` for robot_io.
    """
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    words = [word for setting in settings for word in ("--set", setting)]
    with tempfile.TemporaryDirectory() as folder, contextlib.ExitStack() as stack:
        processes: list[subprocess.Popen[bytes]] = []
        run = ("--run", folder, "--run-id", "live")
        for service in (
            ("services.router", *run, "--listen", endpoint),
            ("services.robot_io", *run, "--connect", endpoint, *words),
        ):
            process = subprocess.Popen(
                [sys.executable, "-m", *service], cwd=ROOT, env=os.environ | environment
            )
            processes.append(process)
            stack.callback(process.wait, 20.0)
            stack.callback(process.terminate)
        bus = open_zenoh(BusConfig(connect=(endpoint,)), "person", SystemClock(), "live")
        stack.callback(bus.close)
        yield Room(bus, processes)
