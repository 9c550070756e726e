"""A world of buses for the contract tests: in memory, or over a real router."""

import itertools
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, Protocol, TypeVar

import pytest

from shared.bus.base import Bus
from shared.bus.config import BusConfig
from shared.bus.memory import MemoryHub
from shared.clock import Clock, ManualClock, SystemClock

X = TypeVar("X")
ROOT = Path(__file__).resolve().parents[3]
INBOX = 8
"""Bound of every inbox and STREAM subscription in these tests."""

_runs = itertools.count()


class World(Protocol):
    """Where buses meet, and time passes."""

    clock: Clock

    def join(self, name: str) -> Bus: ...

    def until(self, condition: Callable[[], X], seconds: float = 5.0) -> X:
        """Let time pass until a condition is true; return it, or its last value."""
        ...

    def rest(self, seconds: float) -> None:
        """Let time pass."""
        ...


class MemoryWorld:
    """Buses in this process; time moves when it is told to."""

    def __init__(self) -> None:
        self.clock = ManualClock()
        self._hub = MemoryHub(self.clock, max_messages=INBOX)
        self._buses: list[Bus] = []

    def join(self, name: str) -> Bus:
        self._buses.append(self._hub.join(name))
        return self._buses[-1]

    def until(self, condition: Callable[[], X], seconds: float = 5.0) -> X:
        for _ in range(int(seconds / 0.01)):
            value = condition()
            if value:
                return value
            for bus in self._buses:
                bus.wait(0.01)
            self.clock.advance(0.01)
        return condition()

    def rest(self, seconds: float) -> None:
        self.until(lambda: False, seconds)

    def close(self) -> None:
        for bus in self._buses:
            bus.close()


class ZenohWorld:
    """Sessions of this process on a router in another one."""

    def __init__(self, endpoint: str, **settings: Any) -> None:
        self.clock = SystemClock()
        self.run = f"run-{next(_runs)}"
        self.cfg = BusConfig(connect=(endpoint,), inbox_messages=INBOX, **settings)
        self._buses: list[Bus] = []

    def join(self, name: str) -> Bus:
        from shared.bus.zenoh import open_zenoh

        self._buses.append(open_zenoh(self.cfg, name, self.clock, self.run))
        return self._buses[-1]

    def until(self, condition: Callable[[], X], seconds: float = 5.0) -> X:
        deadline = self.clock.now() + seconds
        while self.clock.now() < deadline:
            value = condition()
            if value:
                return value
            for bus in self._buses:
                bus.wait(0.005)
        return condition()

    def rest(self, seconds: float) -> None:
        self.until(lambda: False, seconds)

    def close(self) -> None:
        for bus in self._buses:
            bus.close()


class RouterProcess:
    """``python -m services.router`` on a free port of the loopback."""

    def __init__(self, folder: Path) -> None:
        with socket.socket() as probe:
            probe.bind(("127.0.0.1", 0))
            self.port = probe.getsockname()[1]
        self.endpoint = f"tcp/127.0.0.1:{self.port}"
        self._folder = folder
        self.start()

    def start(self) -> None:
        command = [
            sys.executable, "-m", "services.router", "--name", "router",
            "--run", str(self._folder), "--listen", self.endpoint,
        ]  # fmt: skip
        self.process = subprocess.Popen(command, cwd=ROOT, stderr=subprocess.DEVNULL)

    def await_open(self) -> None:
        deadline = time.monotonic() + 15
        while time.monotonic() < deadline:
            assert self.process.poll() is None, f"router exited with {self.process.returncode}"
            with socket.socket() as probe:
                if probe.connect_ex(("127.0.0.1", self.port)) == 0:
                    return
            time.sleep(0.02)
        raise AssertionError("router did not listen within 15 s")

    def kill(self) -> None:
        self.process.kill()
        self.process.wait()


@pytest.fixture(scope="session")
def shared_router(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RouterProcess]:
    router = RouterProcess(tmp_path_factory.mktemp("router"))
    router.await_open()
    yield router
    router.kill()


@pytest.fixture
def own_router(tmp_path: Path) -> Iterator[RouterProcess]:
    router = RouterProcess(tmp_path)
    router.await_open()
    yield router
    router.kill()


@pytest.fixture
def zenoh_world(shared_router: RouterProcess) -> Iterator[ZenohWorld]:
    world = ZenohWorld(shared_router.endpoint)
    yield world
    world.close()


@pytest.fixture(params=["memory", pytest.param("zenoh", marks=pytest.mark.zenoh)])
def world(request: pytest.FixtureRequest) -> Iterator[World]:
    if request.param == "zenoh":
        yield request.getfixturevalue("zenoh_world")
        return
    memory = MemoryWorld()
    yield memory
    memory.close()


@pytest.fixture
def make_world(own_router: RouterProcess) -> Iterator[Callable[..., ZenohWorld]]:
    """A maker of worlds on a router of the test's own, which it may kill."""
    worlds: list[ZenohWorld] = []

    def make(**settings: Any) -> ZenohWorld:
        worlds.append(ZenohWorld(own_router.endpoint, **settings))
        return worlds[-1]

    yield make
    for world in worlds:
        world.close()
