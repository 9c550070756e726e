"""A real training run in a process group of its own, watched from outside.

Nothing in here takes part in the run: what happens is read from its ledger and its logs, so that
the watching fails with nothing that is struck.
"""

import contextlib
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TypeVar

from services.jobs.chaos.books import Books
from services.jobs.chaos.faults import Blow
from services.jobs.chaos.tail import Tail
from services.jobs.chaos.timeline import WINDOW, Timeline
from services.jobs.status import Endpoint, read_endpoint
from services.league.events import RunFinished, StageEnded, StageStarted, VersionEntered
from services.league.ledger import LedgerReader, open_read_only
from shared.clock import Clock
from shared.errors import LedgerError, RiposteError
from shared.messages.league import Stage

X = TypeVar("X")

POLL_SECONDS = 0.05
UNKNOWN = 0
"""Process id of a router that says that it is up before it is known which it is."""
STALL_SECONDS = 2.0
"""Between two looks, above which the machine stood still for whoever is not served first."""
BEGIN_SECONDS = 1800.0
"""Longest wait for a run to begin, on a machine that is busy."""
CALM_SECONDS = 3 * WINDOW
"""Undisturbed at the start of a run, before the first fault."""
FINISH_SECONDS = 600.0
BATCH_SAMPLES = 1280
STAGE_UPDATES = 900
ITERATIONS = 2
SMALL = (
    "actor.num_envs=16",
    "actor.rollout_steps=20",
    "game.bout_steps=200",
    f"learner.batch_samples={BATCH_SAMPLES}",
    f"learner.warm_up_samples={BATCH_SAMPLES}",
    "learner.hidden_dims=[32,32]",
    "learner.minibatches=4",
    "league.evaluation_bouts=8",
    "league.convergence_min_updates=0",
    "train.actors=2",
)
"""A run of several updates a second, with every process that a large one has."""


class JobEnded(Exception):  # noqa: N818 - whether it is an error depends on who waits
    """The run is over."""


class Job:
    """One run of `riposte train`, which may be interrupted and taken up again."""

    verb = "train"
    """Of `riposte`; also the name of the log in which it says what it started."""

    def __init__(
        self,
        folder: Path,
        clock: Clock,
        *,
        seed: int,
        stage_updates: int = STAGE_UPDATES,
        overrides: Sequence[str] = (),
        environment: Mapping[str, str] | None = None,
        clocks: Path = Path(),
    ) -> None:
        """Prepare; ``start`` begins.

        Args:
            folder: of the run.
            clock: of the watching.
            seed: of the run.
            stage_updates: updates in each of its four stages.
            overrides: ``section.key=value``, over those of the small run.
            environment: variables of all its processes.
            clocks: folder of their wall clocks.
        """
        self.folder = folder
        self.clock = clock
        self.timeline = Timeline()
        self.books = Books()
        self.stage: Stage | None = None
        self.finished = False
        """Whether the ledger says that everything was done."""
        self.stalled = 0.0
        """How long the machine stood still (s)."""
        self._looked_at = 0.0
        self.unsafe = 0
        """Commands to a robot outside the gate's rules; a training run has no robot."""
        self.commands = 0
        """Commands to a robot that were checked."""
        self.began_at = clock.now()
        self._updates = 0
        self._stages_left = 2 * ITERATIONS
        self._stage_updates = stage_updates
        self._overrides: tuple[str, ...] = (
            *SMALL,
            f"league.iterations={ITERATIONS}",
            f"league.antagonist_updates={stage_updates}",
            f"league.protagonist_updates={stage_updates}",
            f"train.seed={seed}",
            *overrides,
        )
        self.clocks = clocks
        """Where the wall clocks of its processes are, if they can be stepped."""
        self._environment = dict(environment or {})
        self._process: subprocess.Popen[bytes] | None = None
        self._guests: list[subprocess.Popen[bytes]] = []
        self._ledger: LedgerReader | None = None
        self._position = 0
        self._is_catching_up = False
        """What is read first happened before this process watched."""
        self._log = Tail(folder / "logs" / f"{self.verb}.jsonl")
        self._logs: dict[str, Tail] = {}
        self._pids: dict[str, int] = {}
        self.up: dict[str, int] = {}
        """Process id under which each last said that it was up."""
        self.events: dict[str, list[str]] = {}
        """What each process has logged, the names of the events alone."""

    # -- the run -----------------------------------------------------------------------------

    def start(self, *, resume: bool = False) -> None:
        """Begin, or go on where the ledger ends."""
        command = [sys.executable, "-P", "-m", "services.cli", *self._words()]
        command += ["--resume"] if resume else []
        self._is_catching_up = resume and not self._position
        self.folder.parent.mkdir(parents=True, exist_ok=True)
        with self.folder.with_suffix(".out").open("ab") as output:
            self._process = subprocess.Popen(
                command, stdin=subprocess.DEVNULL, stdout=output, stderr=subprocess.STDOUT,
                env={**os.environ, **self._environment}, process_group=0,
            )  # fmt: skip

    def _words(self) -> list[str]:
        """Return the command line behind `riposte`."""
        settings = [word for one in self._overrides for word in ("--set", one)]
        return [self.verb, "--out", str(self.folder), *settings]

    def settle(self) -> None:
        """Wait until it does what it is for, and for a stretch that nobody disturbs.

        Raises:
            JobEnded: the run is over.
            RiposteError: it does not come to that.
        """
        if not self.until(self._is_going, BEGIN_SECONDS):
            raise RiposteError(f"{self.folder}: nothing goes on there after {BEGIN_SECONDS:g} s")
        self.rest(1.0)
        now = self.clock.now()
        self.rest(CALM_SECONDS)
        self.timeline.note_calm(now, self.clock.now())

    def ready(self) -> None:
        """Wait until a fault can strike; a training run always can be struck."""

    def after(self, blow: Blow) -> Blow:
        """Put right what takes a person; a training run needs none."""
        return blow

    def _is_going(self) -> bool:
        now = self.clock.now()
        return self.timeline.rate(now - WINDOW, now) > 0.0

    @property
    def seconds_left(self) -> float:
        """Return how long it goes on if nobody disturbs it (s)."""
        rate = self.timeline.base
        return self.updates_left * BATCH_SAMPLES / rate if rate else 0.0

    @property
    def exit_code(self) -> int | None:
        """Return how it ended; None while it goes on."""
        return None if self._process is None else self._process.poll()

    @property
    def endpoint(self) -> Endpoint:
        """Return where its bus is."""
        return read_endpoint(self.folder)

    @property
    def updates_left(self) -> int:
        """Return how many updates are still to be made, by the ledger."""
        return max(self._stages_left * self._stage_updates - self._updates, 0)

    def interrupt(self, seconds: float = 60.0) -> int:
        """Stop it as Ctrl-C does; return the exit code."""
        assert self._process is not None
        if self._process.poll() is None:
            self._process.send_signal(signal.SIGINT)
        return self._process.wait(seconds)

    def let_in(self, command: Sequence[str]) -> "subprocess.Popen[bytes]":
        """Start a process that joins the run from outside."""
        with self.folder.with_suffix(".out").open("ab") as output:
            guest = subprocess.Popen(
                command, stdin=subprocess.DEVNULL, stdout=output, stderr=subprocess.STDOUT,
                env={**os.environ, **self._environment, "OMP_NUM_THREADS": "1"},
            )  # fmt: skip
        self._guests.append(guest)
        return guest

    def close(self) -> None:
        """Leave no process of it behind."""
        for process in (*self._guests, self._process):
            if process is not None and process.poll() is None:
                process.kill()  # the kernel kills its children
                process.wait()
        if self._ledger is not None:
            self._ledger.close()

    # -- what is seen of it ------------------------------------------------------------------

    def pid(self, name: str) -> int | None:
        """Return the id of a process, None while it is down."""
        return self._pids.get(name)

    def is_up(self, name: str, *, but: int | None = None) -> bool:
        """Return whether a process has come up, as another than the one given."""
        pid = self._pids.get(name)
        return pid is not None and pid != but and self.up.get(name) == pid

    @property
    def learner(self) -> str:
        """Return the name of the learner whose turn it is."""
        return f"learner-{self.stage.agent}" if self.stage else "learner-antagonist"

    def poll(self) -> None:
        """Take what is new in logs and ledger; acknowledgements before what they speak of."""
        for event in self._log.read():
            name = event.get("process")
            if name is not None:
                if event["event"] in ("process_started", "process_restarted"):
                    self._pids[name] = event["pid"]
                    if self.up.get(name) == UNKNOWN:  # it was up before it was said to be started
                        self.up[name] = event["pid"]
                else:
                    self._pids.pop(name, None)
        logs = self.folder / "logs"
        for path in sorted(logs.glob("*.jsonl")) if logs.is_dir() else ():
            if path.stem != "train":
                self._read_log(path)
        self._read_ledger()

    def _read_log(self, path: Path) -> None:
        tail = self._logs.setdefault(path.stem, Tail(path))
        for event in tail.read():
            self.books.hear(event)
            if event.get("event") in ("service_started", "router_started"):
                self.up[path.stem] = event.get("pid") or self._pids.get(path.stem, UNKNOWN)
            if event.get("level") in ("warning", "error", "critical"):
                self.events.setdefault(path.stem, []).append(str(event.get("event")))

    def _read_ledger(self) -> None:
        with contextlib.suppress(LedgerError):  # not there yet, or just being made or resumed
            if self._ledger is None:
                self._ledger = open_read_only(self.folder / "league.sqlite")
            now = self.clock.now()
            entries = list(self._ledger.replay(self._position))
            if not entries and not self._position:
                self._ledger.close()
                self._ledger = None
            for entry in entries:
                self._position = entry.seq
                self.books.enter(entry.event, self.folder / "snapshots")
                match entry.event:
                    case VersionEntered(metrics=metrics) if metrics is not None:
                        if not self._is_catching_up:
                            self.timeline.add(now, metrics.samples)
                        self._updates += 1
                    case StageStarted(stage=stage):
                        self.stage = stage
                        self._updates = 0
                    case StageEnded():
                        self._stages_left -= 1
                        self._updates = 0
                    case RunFinished():
                        self.finished = True
                    case _:
                        pass
            self._is_catching_up &= not entries

    def until(self, condition: Callable[[], X], seconds: float) -> X | None:
        """Return the condition's first true value, None where it does not come in time.

        Raises:
            JobEnded: the run is over.
        """
        deadline = self.clock.now() + seconds
        while True:
            self._note_stall()
            self.poll()
            if value := condition():
                return value
            if self.exit_code is not None:
                raise JobEnded(f"exit code {self.exit_code}")
            if self.clock.now() >= deadline:
                return None
            self._rest()

    def _note_stall(self) -> None:
        """Count the time in which this process, which does next to nothing, got no processor."""
        now = self.clock.now()
        gap = now - self._looked_at - POLL_SECONDS
        if self._looked_at and gap > STALL_SECONDS:
            self.stalled += gap
        self._looked_at = now

    def rest(self, seconds: float) -> None:
        """Watch for so long.

        Raises:
            JobEnded: the run is over.
        """
        self.until(lambda: False, seconds)

    def finish(self) -> int:
        """Wait for the end, at most ``FINISH_SECONDS``; return the exit code."""
        with contextlib.suppress(JobEnded):
            self.until(lambda: False, FINISH_SECONDS)
        self.poll()
        code = self.exit_code
        return self.interrupt() if code is None else code

    def _rest(self) -> None:
        assert self._process is not None
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(POLL_SECONDS)
