"""`riposte play`: fence against the robot on a page, or let two policies play, on this machine.

Starts router, recorder, robot_io, policies, referee and the page, shows how it goes, and ends with
the scores. Where two policies play, typing the command arms the simulated robot, once; else a
person does so on the page or with `riposte robot arm`, and a real robot is never armed otherwise.
"""

import contextlib
import os
import sys
import threading
import webbrowser
from collections.abc import Sequence
from pathlib import Path
from typing import Protocol

import msgspec
import structlog
from rich.console import Console

from services.jobs.play.match import Match, Terms
from services.jobs.play.page import has_browser, read_page_url
from services.jobs.play.plan import RUNS, Plan, parse, plan_of
from services.jobs.play.processes import LIVE, processes
from services.jobs.play.screen import Screen
from services.jobs.play.summary import PlayedMatch, summary_of, summary_text, write_summary
from services.jobs.status import Endpoint, write_endpoint
from services.jobs.train.processes import StopAsked, endpoint_of, wait_for_router
from services.jobs.who import operator
from services.supervisor import ProcessSpec, Supervisor
from shared.bus.base import Bus
from shared.bus.zenoh import open_zenoh
from shared.clock import SystemClock
from shared.errors import RiposteError
from shared.runtime.files import RunLock, atomic_write, require_free_space
from shared.runtime.logging import configure_logging
from shared.runtime.serve import EXIT_BAD_INPUT
from shared.runtime.stop import stop_on_signals

FREE_BYTES = 256 << 20
"""A match needs this much disk to begin with."""
LAST_WORDS_BYTES = 1 << 20
"""With less free disk, a process that ended without a word had no room for one."""
TICK_SECONDS = 0.03
SHUT_SECONDS = 1.0
"""Longest wait for the gate to shut at the end; the robot is held by robot_io's own end, too."""
LATEST = "latest-play"
EXIT_UNFINISHED = 1
EXIT_INTERRUPTED = 130

log = structlog.get_logger()


def main(argv: Sequence[str] | None = None) -> int:
    """Play a match; return the exit code."""
    found = parse(sys.argv[1:] if argv is None else argv)
    plan = plan_of(found)
    console = Console(stderr=found.json)
    folder = plan.folder
    with RunLock(folder), Path(os.devnull).open("w") as nowhere:  # the screen says what happens
        require_free_space(folder, FREE_BYTES)
        atomic_write(folder / "config.toml", plan.settings.encode())
        _point_latest_at(folder)
        configure_logging(
            folder / "logs" / "play.jsonl", console=nowhere,
            bound={"service": "play", "run_id": plan.run},
        )  # fmt: skip
        # A signal ends the loop below; the deadline is for processes that will not stop.
        with stop_on_signals(deadline=180.0) as stop:
            course = Course(plan, console, stop, browser=not found.no_browser)
            try:
                code = course.run()
            finally:
                played = course.summary()
                write_summary(folder, played)
    if found.json:
        print(msgspec.json.encode(played).decode())
    else:
        print(summary_text(folder, played))
    return code


def _point_latest_at(folder: Path) -> None:
    """Let ``runs/latest-play`` be this match, when it lies in ``runs``."""
    if folder.parent != RUNS:
        return
    link = RUNS / LATEST
    with contextlib.suppress(OSError):
        if link.is_symlink() or not link.exists():
            temporary = link.with_name(f".{LATEST}.{os.getpid()}")
            temporary.symlink_to(folder.name)
            temporary.replace(link)


class Host(Protocol):
    """Somebody who arms, starts and ends the bouts of a match in the place of this job."""

    @property
    def title(self) -> str:
        """Return what it is, for people."""
        ...

    @property
    def is_over(self) -> bool:
        """Return whether the match is to end."""
        ...

    def processes(self, made: list[ProcessSpec], endpoint: str) -> list[ProcessSpec]:
        """Return what to start, given what a match starts."""
        ...

    def listen(self, bus: Bus) -> None:
        """Begin to listen."""
        ...

    def tick(self, screen: Screen) -> None:
        """Show how it goes."""
        ...


class Course:
    """A match from the first process to the last."""

    def __init__(
        self, plan: Plan, console: Console, stop: threading.Event, *, browser: bool,
        host: Host | None = None,
    ) -> None:  # fmt: skip
        """Prepare.

        Args:
            plan: what to play.
            console: to draw on.
            stop: set when the person at the terminal asks to stop.
            browser: whether to open pages.
            host: who leads the match; None where this job does.
        """
        self._host = host
        self._plan = plan
        self._console = console
        self._stop = stop
        self._browser = browser
        self._clock = SystemClock()
        self._deaths: list[str] = []
        self._match: Match | None = None
        self._screen: Screen | None = None
        self._ended = ""

    def summary(self) -> PlayedMatch:
        """Return what came of it so far."""
        results = self._match.results if self._match is not None else []
        status = self._screen.status if self._screen is not None else None
        return summary_of(self._plan, results, status, self._deaths, self._ended)

    def run(self) -> int:
        """Play; return the exit code.

        Raises:
            RiposteError: a process cannot be kept alive; the others are stopped.
        """
        plan = self._plan
        endpoint = endpoint_of(plan.bus)
        write_endpoint(
            plan.folder,
            Endpoint(connect=endpoint, run=plan.run, certificates=plan.bus.certificates),
        )
        specs = processes(plan, endpoint)
        if self._host is not None:
            specs = self._host.processes(specs, endpoint)
        supervisor = Supervisor(specs, plan.folder / "logs", self._clock)
        try:
            for event in supervisor.start():
                log.info("process_started", process=event.name, pid=event.pid)
            wait_for_router(endpoint, supervisor, self._stop)
            return self._play(endpoint, supervisor)
        except StopAsked:
            self._ended = "stopped before it began"
            return EXIT_INTERRUPTED
        except RiposteError as error:
            self._ended = str(error).partition("\n")[0]
            raise
        finally:
            for event in supervisor.stop():
                log.info("process_stopped", process=event.name, exit_code=event.exit_code)
            (plan.folder / "endpoint.json").unlink(missing_ok=True)

    def _play(self, endpoint: str, supervisor: Supervisor) -> int:
        plan = self._plan
        cfg = msgspec.structs.replace(plan.bus, connect=(endpoint,))
        with contextlib.closing(open_zenoh(cfg, "play", self._clock, plan.run)) as bus:
            match = self._match = Match(self._terms(), bus, self._clock)
            host = self._host
            title = host.title if host is not None else ""
            with (
                contextlib.closing(match),
                Screen(plan, match, bus, self._clock, self._console, title) as screen,
            ):
                self._screen = screen
                if host is not None:
                    host.listen(bus)
                while not match.is_over and not self._stop.wait(TICK_SECONDS):
                    bus.wait(0.0)
                    self._watch(supervisor, match, screen)
                    match.tick()
                    if host is not None:
                        host.tick(screen)
                        if host.is_over:
                            break
                    self._open_page(screen)
                    screen.tick()
                shut = match.shut()
                deadline = self._clock.now() + SHUT_SECONDS
                while shut.take() is None or match.is_bout_on:
                    if self._clock.now() >= deadline:
                        break
                    bus.wait(TICK_SECONDS)
                    match.hear()
                screen.tick()
        self._ended = match.ended
        if match.ended:
            return EXIT_UNFINISHED
        is_whole = not plan.bouts or match.finished >= plan.bouts
        if host is not None:
            is_whole = host.is_over
        if not is_whole:
            self._ended = "stopped by Ctrl-C"
        return 0 if is_whole else EXIT_INTERRUPTED

    def _terms(self) -> Terms:
        plan = self._plan
        is_led = self._host is not None
        return Terms(
            antagonist=plan.antagonist.reference,
            protagonist=plan.protagonist.reference,
            bouts=plan.bouts,
            arms=plan.is_armed_by_typing and not is_led,
            starts=plan.starts_bouts and not is_led,
            ends=not is_led,
            rest=plan.play.rest,
            patience=plan.play.patience,
            operator=operator(),
            again=f"riposte robot arm --run {plan.folder}",
        )

    def _watch(self, supervisor: Supervisor, match: Match, screen: Screen) -> None:
        """Start again what died, and keep the robot still where it depends on that."""
        for event in supervisor.poll():
            log.info(
                f"process_{event.kind}", process=event.name, pid=event.pid,
                exit_code=event.exit_code,
            )  # fmt: skip
            if event.kind == "gave_up":
                if not event.tail.strip():  # perhaps because the disk had no room for its words
                    require_free_space(self._plan.folder, LAST_WORDS_BYTES)
                is_told = event.exit_code == EXIT_BAD_INPUT  # in one line, which is its last
                raise RiposteError(event.describe if is_told else f"{event.describe}\n{event.tail}")
            screen.say(event.describe)
            if event.kind == "died":
                self._deaths.append(event.describe)
                if event.name.startswith(LIVE):
                    match.on_death(event.name)

    def _open_page(self, screen: Screen) -> None:
        """Say where the page is, once it is there, and open it."""
        if "page" in screen.places or not self._plan.has_page:
            return
        if (url := read_page_url(self._plan.folder)) is None:
            return
        screen.places["page"] = url
        screen.say(f"page: {url}")
        if self._browser and has_browser():
            webbrowser.open(url)


if __name__ == "__main__":
    sys.exit(main())
