"""Processes of a live site."""

import json
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

from shared.bus.base import Bus
from shared.bus.config import BusConfig
from shared.bus.ports import free_port
from shared.bus.zenoh import open_zenoh
from shared.clock import SystemClock
from shared.messages.play import BatStates, GateReply, GateRequest, GateState
from shared.messages.topics import ARM, BATS, GATE, STATUS

ROOT = Path(__file__).resolve().parents[3]
POLICY = Path(__file__).with_name("policy.py")


class Site:
    """A router and robot_io, each a process, and what else a test starts; it is the person."""

    def __init__(self, folder: Path, *settings: str) -> None:
        """Start both; the settings are robot_io's."""
        self.endpoint = f"tcp/127.0.0.1:{free_port()}"
        self.folder = folder
        self._run = ("--run", str(folder), "--run-id", "live")
        self._settings = ("safety.ramp=0.5", *settings)
        self.processes: list[subprocess.Popen[bytes]] = []
        self.router = self.start_router()
        try:
            self.bus = self.join("person")
        except BaseException:
            self.end()
            raise
        self.bats = self.bus.subscribe(BATS)
        self.gates = self.bus.subscribe(GATE)
        self.status = self.bus.subscribe(STATUS, role="robot-io")
        self.states: list[BatStates] = []
        self.seen: list[GateState] = []
        self.robot_io = self.start_robot_io()

    def join(self, name: str) -> Bus:
        return open_zenoh(BusConfig(connect=(self.endpoint,)), name, SystemClock(), "live")

    def start_router(self) -> "subprocess.Popen[bytes]":
        return self._start("-m", "services.router", *self._run, "--listen", self.endpoint)

    def start_robot_io(self) -> "subprocess.Popen[bytes]":
        words = [word for setting in self._settings for word in ("--set", setting)]
        return self.service("robot_io", *words)

    def start_policy(self, kind: str = "moving") -> "subprocess.Popen[bytes]":
        return self._start(str(POLICY), kind, self.endpoint)

    def service(self, module: str, *words: str) -> "subprocess.Popen[bytes]":
        return self._start(
            "-m", f"services.{module}", *self._run, "--connect", self.endpoint, *words
        )

    def _start(self, *words: str) -> "subprocess.Popen[bytes]":
        process = subprocess.Popen([sys.executable, *words], cwd=ROOT)
        self.processes.append(process)
        return process

    def kill(self, process: "subprocess.Popen[bytes]") -> None:
        """As by ``kill -9``."""
        process.kill()
        process.wait()

    def until(self, condition: Callable[[], bool], seconds: float = 20.0) -> None:
        deadline = time.monotonic() + seconds
        while time.monotonic() < deadline:
            while (states := self.bats.take()) is not None:
                self.states.append(states)
            while (gate := self.gates.take()) is not None:
                self.seen.append(gate)
            if condition():
                return
            self.bus.wait(0.01)
        raise AssertionError(f"not within {seconds} s; the gate: {self.seen[-1:]}")

    def rest(self, seconds: float) -> None:
        """Listen for so long."""
        deadline = time.monotonic() + seconds
        self.until(lambda: time.monotonic() >= deadline, seconds + 5.0)

    def modes(self) -> list[str]:
        """Return the gate's modes, every one, as robot_io logs them: the bus has the newest."""
        (path,) = self.folder.glob("logs/robot*io-0.jsonl")
        lines = path.read_text().splitlines(keepends=True)
        events = [json.loads(line) for line in lines if line.endswith("\n")]
        return [event["mode"] for event in events if event["event"] == "gate_changed"]

    def is_mode(self, *modes: str) -> bool:
        return bool(self.seen) and self.seen[-1].mode in modes

    def ask(self, action: str) -> GateReply:
        asked = GateRequest(action=action, operator="test")  # type: ignore[arg-type]
        pending = self.bus.ask(ARM, asked, timeout=3.0)
        self.until(lambda: pending.take() is not None, 5.0)
        reply = pending.take()
        assert isinstance(reply, GateReply)
        return reply

    def arm(self) -> None:
        self.until(lambda: len(self.states) > 20)
        replies: list[GateReply] = []

        def accepted() -> bool:  # until the policy's process answers
            replies.append(self.ask("arm"))
            return replies[-1].accepted

        self.until(accepted)
        self.until(lambda: self.is_mode("armed"))

    def close(self) -> None:
        self.bus.close()
        self.end()

    def end(self) -> None:
        """Kill every process."""
        for process in reversed(self.processes):
            self.kill(process)
