"""`riposte study run` as a person starts it, and the two people at its pages, by their sockets."""

import contextlib
import itertools
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from websockets.exceptions import ConnectionClosed, InvalidHandshake
from websockets.sync.client import ClientConnection, connect

from services.jobs.study.hosting import read_place
from shared.clock import SystemClock
from shared.sim.arena import target_of
from shared.sim.config import SimConfig
from shared.study.drawing import draw_orders
from shared.study.events import Event
from shared.study.folder import Study, make_study
from shared.study.journal import read_journal
from tests.integration.training.training import ROOT, processes_of

X = TypeVar("X")
QUICK = (
    "recorder.live=false", "safety.ramp=0.5", "safety.command_hold=0.5",
    "safety.command_trip=2.0", "safety.tracker_hold=0.5", "safety.state_hold=0.5",
    "safety.state_trip=0.5", "policy.stale_after=1.0", "policy.referee_silence=2.0",
    "robot_io.referee_silence=2.0", "referee.stale_after=1.0", "referee.void_after=10.0",
    "study.countdown=0.3", "study.score_seconds=0.3",
)  # fmt: skip
"""A session on a machine that tests keep busy."""
SHORT = """
schema = 1
name = "short"
title = "A short study"
people = 4
[consent]
text = "We measure your heart."
statements = ["I agree."]
[order]
kind = "fixed"
[[baseline]]
name = "walking"
title = "Walk"
seconds = 2.0
[instruction]
text = "Hit the target."
[explore]
seconds = 2.0
[warm_up]
games = 1
speed = 0.5
player = "scripted:guard"
[game]
seconds = 1.5
[[condition]]
name = "easy"
player = "scripted:guard"
[[condition]]
name = "hard"
player = "style-1"
[[section]]
games = 2
rest = 1.0
instruments = ["mood"]
[[section]]
games = 2
rest = 1.0
instruments = ["mood", "comparison"]
[[instrument]]
name = "mood"
title = "The last games"
[[instrument.item]]
id = "fun"
construct = "enjoyment"
text = "It was fun."
[[instrument]]
name = "comparison"
title = "Compare"
[[instrument.item]]
id = "difficulty"
construct = "difficulty"
text = "How difficult?"
scale = "ranking"
ends = ["least", "most"]
"""


def make(folder: Path, protocol: str = SHORT, people: int = 4) -> Study:
    """Make a study with orders, a recorded bat that visits the target, and a recorded heart."""
    clock = SystemClock()
    made = make_study(folder, protocol.encode(), "protocol.toml", "test", clock)
    times = np.arange(0.0, 8.0, 0.01)
    rows = np.zeros((len(times), 14))
    x, y, z = target_of(SimConfig()).centre
    rows[:, 0], rows[:, 4] = times, 1.0
    rows[:, 1], rows[:, 2] = x - 0.3, y + 0.25 * np.sin(2.0 * np.pi * times / 8.0)
    rows[:, 3] = z
    np.save(folder.with_suffix(".bat.npy"), rows)
    beats = "\n".join(f"{second}.0,{80 + second % 7}" for second in range(60))
    folder.with_suffix(".heart.csv").write_text(f"seconds,beats_per_minute\n{beats}\n")
    return draw_orders(made.folder, people, 1, clock)


class Run:
    """A runner that goes on."""

    def __init__(self, process: "subprocess.Popen[str]", said: Path) -> None:
        self.process = process
        self._said = said

    @property
    def said(self) -> str:
        return self._said.read_text()

    def finish(self, seconds: float = 60.0) -> tuple[int, str]:
        return self.process.wait(seconds), self.said

    def kill(self) -> None:
        """End it as ``kill -9`` does; its processes die with it."""
        self.process.kill()
        self.process.wait()


@contextlib.contextmanager
def running(
    study: Study, participant: str, *words: str, has_recording: bool = False
) -> Iterator[Run]:  # fmt: skip
    """Run a session, and leave no process of it behind."""
    folder = study.folder
    overrides = (
        *QUICK, f"recorder.file={str(has_recording).lower()}", "robot_io.tracker=replay",
        f"robot_io.replay={folder.with_suffix('.bat.npy')}",
        "heart_rate.source=replay", f"heart_rate.file={folder.with_suffix('.heart.csv')}",
    )  # fmt: skip
    command = [
        sys.executable, "-m", "services.cli", "study", "run", str(folder), "--participant",
        participant, "--antagonist", "replay", "--no-browser", *words,
    ]  # fmt: skip
    command += [word for override in overrides for word in ("--set", override)]
    said = folder.with_suffix(f".{participant}.out")
    with said.open("a") as output:
        process = subprocess.Popen(
            command, cwd=ROOT, stdin=subprocess.DEVNULL, stdout=output, stderr=subprocess.STDOUT,
            text=True,
        )  # fmt: skip
    try:
        yield Run(process, said)
    finally:
        process.kill()
        process.wait()
        for pid in processes_of(study.session_folder(participant)):
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)


class Socket:
    """One page's connection: views in, asks out; asks are said again until they are answered."""

    def __init__(self, folder: Path, role: str) -> None:
        self._folder = folder
        self._role = role
        self._stack = contextlib.ExitStack()
        self._socket: ClientConnection | None = None
        self.view: dict[str, Any] = {}
        self.pending: dict[str, str] = {}
        self.replies: dict[str, dict[str, Any]] = {}

    def pump(self) -> None:
        """Take what has come; connect where there is no connection."""
        try:
            if self._socket is None and not self._connect():
                return
            assert self._socket is not None
            while True:
                said = json.loads(self._socket.recv(timeout=0))
                if said["type"] == "view":
                    self.view = said["view"]
                else:
                    self.replies[said["reply"]["id"]] = said["reply"]
                    self.pending.pop(said["reply"]["id"], None)
        except TimeoutError:
            return
        except (ConnectionClosed, OSError):
            self._socket, self.view = None, {}

    def ask(self, id: str, **fields: Any) -> None:
        self.pending[id] = json.dumps({"id": id, **fields})
        self._send(self.pending[id])

    def close(self) -> None:
        self._stack.close()

    def _connect(self) -> bool:
        if (place := read_place(self._folder)) is None:
            return False
        page, _, query = getattr(place, self._role).partition("?")
        address = f"{page.replace('http', 'ws')}/socket?{query}".rstrip("?")
        try:
            opened = connect(address, compression=None, open_timeout=2, close_timeout=1)
            self._socket = self._stack.enter_context(opened)
        except (OSError, InvalidHandshake, TimeoutError):
            return False
        for text in self.pending.values():
            self._send(text)
        return True

    def _send(self, text: str) -> None:
        with contextlib.suppress(ConnectionClosed, OSError):
            if self._socket is not None:
                self._socket.send(text)


class People:
    """The researcher and the participant; they do what has to be done next."""

    def __init__(self, folder: Path) -> None:
        self.researcher = Socket(folder, "researcher")
        self.participant = Socket(folder, "participant")
        self._ids = itertools.count()
        self.refused: list[str] = []
        self._rests_until = 0.0

    def tick(self) -> None:
        for page in (self.researcher, self.participant):
            page.pump()
            for reply in page.replies.values():
                if not reply["is_done"]:
                    self.refused += reply["lines"]
                    self._rests_until = time.monotonic() + 0.3
            page.replies.clear()
        if time.monotonic() < self._rests_until:
            return
        if not self.researcher.pending:
            self._lead()
        if not self.participant.pending:
            self._take_part()

    def until(self, condition: Callable[[], X], run: Run, seconds: float = 90.0) -> X:
        deadline = time.monotonic() + seconds
        while not (value := condition()):
            self.tick()
            assert run.process.poll() is None, f"it ended: {run.said}"
            where = self.researcher.view.get("waiting_for"), self.refused[-3:]
            assert time.monotonic() < deadline, f"in vain: {where} {run.said[-1500:]}"
            time.sleep(0.01)
        return value

    def close(self) -> None:
        self.researcher.close()
        self.participant.close()

    def _lead(self) -> None:
        view = self.researcher.view
        if not view:
            return
        step = view["steps"][view["at"]]["id"] if view["at"] < len(view["steps"]) else ""
        mode = view["gate"]["mode"]
        if view["course"] == "running" and mode in ("disarmed", "tripped"):
            self._ask("reset" if mode == "tripped" else "arm", step)
        elif "begin" in view["may"]:
            self._ask("begin", step)

    def _ask(self, action: str, step: str) -> None:
        self.researcher.ask(f"r-{next(self._ids)}", action=action, step=step)

    def _take_part(self) -> None:
        view = self.participant.view
        may = view.get("may", [])
        if not may:
            return
        answers = [
            {"item": item["id"], "ranks": list(range(1, len(item["options"]) + 1))}
            if may[0] == "ranking" else _answer_to(item)
            for item in view["items"]
        ]  # fmt: skip
        self.participant.ask(
            f"p-{next(self._ids)}", action=may[0], step=view["step"], answers=answers
        )


def _answer_to(item: dict[str, Any]) -> dict[str, Any]:
    if item["scale"] == "points":
        return {"item": item["id"], "value": 3}
    if item["scale"] == "choices":
        return {"item": item["id"], "choices": item["options"][:1]}
    return {"item": item["id"], "text": "words"}


def events_of(study: Study, participant: str = "sub-01") -> tuple[Event, ...]:
    return read_journal(study.session_folder(participant))
