"""A stage for live bouts: router, referee, policy and a publisher, each a process of its own."""

import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import TypeVar

import numpy as np
import pytest

from services.supervisor import service_command
from shared.bus.base import NoAnswer
from shared.bus.config import BusConfig
from shared.bus.zenoh import open_zenoh
from shared.clock import SystemClock
from shared.game.rules import RuleBook
from shared.messages.play import (
    DesiredOffset,
    PlayerReply,
    PlayerRequest,
    PlayReply,
    PlayRequest,
    RefereeState,
)
from shared.messages.topics import BOUT, OFFSET, PLAYER, REFEREE
from tests.integration.bus.conftest import ROOT, RouterProcess
from tests.replay.recorded import play

X = TypeVar("X")
STEPS = 250
MARGIN = 100
"""Steps of a live bout beyond the recorded ones: the bats are en garde in these."""
RULES = RuleBook(bout_steps=STEPS, camping_steps=30)
COUNTERS = ("score", "attack_steps", "penalty_steps", "camping_steps")
RUN_ID = "play"


@pytest.fixture(scope="session")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, float]]:
    """Return the file of a recorded bout, and what the actor says of it."""
    bouts = play("slash", "heuristic", RULES, 16, seed=1)
    worlds = [
        world
        for world in range(16)
        if bouts.results.attack_steps[world] and bouts.results.penalty_steps[world]
    ]
    world = worlds[0]
    file = tmp_path_factory.mktemp("recorded") / "bout.npz"
    np.savez(file, first=bouts.first[world], bats=bouts.bats[:, world])
    return file, {name: getattr(bouts.results, name)[world].item() for name in COUNTERS}


class Stage:
    """The processes of a live bout, and a seat to watch and to ask from."""

    def __init__(self, router: RouterProcess, folder: Path, bout: Path) -> None:
        self.folder = folder
        self._router = router
        self._bout = bout
        self._processes: dict[str, subprocess.Popen[str]] = {}
        self.bus = open_zenoh(
            BusConfig(connect=(router.endpoint,)), "watcher", SystemClock(), RUN_ID
        )
        self._referee = self.bus.subscribe(REFEREE)
        self._offsets = self.bus.subscribe(OFFSET)
        self.seen: list[RefereeState] = []
        self.offsets: list[DesiredOffset] = []

    def start(self, role: str, *overrides: str, agent: str = "") -> subprocess.Popen[str]:
        command = service_command(
            role, name=f"{role}-0", run=self.folder, run_id=RUN_ID, agent=agent,
            connect=(self._router.endpoint,),
            overrides=(
                f"game.bout_steps={STEPS + MARGIN}",
                f"game.camping_steps={RULES.camping_steps}",
                *overrides,
            ),
        )  # fmt: skip
        return self._run(role, command)

    def publish(self) -> None:
        script = str(Path(__file__).with_name("publisher.py"))
        self._run(
            "publisher", (sys.executable, script, self._router.endpoint, RUN_ID, str(self._bout))
        )

    def _run(self, name: str, command: Sequence[str]) -> subprocess.Popen[str]:
        process = subprocess.Popen(
            command, cwd=ROOT, stderr=subprocess.PIPE, text=True, env={"PYTHONPATH": str(ROOT)}
        )
        self._processes[name] = process
        return process

    def send_signal(self, name: str, number: signal.Signals) -> None:
        self._processes[name].send_signal(number)

    def kill(self, name: str) -> None:
        process = self._processes[name]
        process.kill()
        process.communicate(timeout=10)

    def listen(self) -> None:
        """Take what has arrived."""
        self.bus.wait(0.01)
        while (state := self._referee.take()) is not None:
            self.seen.append(state)
        while (offset := self._offsets.take()) is not None:
            self.offsets.append(offset)

    def until(self, condition: Callable[[], X], seconds: float = 60.0) -> X:
        deadline = time.monotonic() + seconds
        while not (value := condition()):
            assert time.monotonic() < deadline, f"did not happen; seen last: {self.seen[-1:]}"
            self.listen()
        return value

    def alive(self, role: str) -> bool:
        return bool(self.bus.alive(role))

    def phase(self, bout: str = "") -> str:
        """Return the phase of a bout, as far as the referee has said."""
        states = [state for state in self.seen if not bout or state.bout == bout]
        return states[-1].phase if states else ""

    def ask(self, action: str, bout: str) -> PlayReply:
        request = PlayRequest(action=action, bout=bout, antagonist="a", protagonist="p")  # type: ignore[arg-type]
        pending = self.bus.ask(BOUT, request, 5.0)
        answer = self.until(pending.take)
        if isinstance(answer, NoAnswer):  # it is not there yet
            return PlayReply(accepted=False, phase="ready", reason=answer.reason)
        assert isinstance(answer, PlayReply), answer
        return answer

    def change_player(self, player: str) -> PlayerReply:
        pending = self.bus.ask(
            PLAYER, PlayerRequest(player=player), 5.0, agent="protagonist"
        )  # fmt: skip
        answer = self.until(pending.take)
        assert isinstance(answer, PlayerReply), answer
        return answer

    def begin(self, bout: str) -> None:
        """Start a bout once the referee is there and the bats are tracked."""
        self.until(lambda: self.alive("referee"))
        self.until(lambda: self.ask("start", bout).accepted)
        self.until(lambda: self.phase(bout))

    def close(self) -> None:
        for process in self._processes.values():
            if process.poll() is None:
                process.kill()
            process.communicate(timeout=10)
        self.bus.close()


@pytest.fixture
def stage(
    shared_router: RouterProcess, recorded: tuple[Path, dict[str, float]], tmp_path: Path
) -> Iterator[Stage]:
    made = Stage(shared_router, tmp_path, recorded[0])
    yield made
    made.close()


@pytest.fixture(scope="session")
def shared_router(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RouterProcess]:
    router = RouterProcess(tmp_path_factory.mktemp("router"))
    router.await_open()
    yield router
    router.kill()
