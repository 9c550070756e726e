"""`riposte train`: phase one on this machine, from two fresh policies to a report.

Starts router, league, two learners, recorder and actors, watches them, shows where the run
stands, and ends with the report. ``--serial`` runs the same services in one process.
"""

import argparse
import contextlib
import datetime
import json
import os
import shutil
import socket
import sys
import threading
import webbrowser
from collections.abc import Generator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import msgspec
import structlog

from services.jobs.settings import BUDGETS, Settings, TrainConfig
from services.supervisor import ProcessEvent, ProcessSpec, Supervisor, service_command
from shared.bus.base import Bus
from shared.bus.config import BusConfig
from shared.bus.delivery import Outbox
from shared.bus.ports import free_port
from shared.clock import SystemClock
from shared.errors import ConfigError, RiposteError
from shared.messages.league import Incident
from shared.messages.topics import INCIDENT, SCHEDULE
from shared.messages.training import AGENTS, Receipt
from shared.runtime.files import RunLock, atomic_write, require_free_space
from shared.runtime.logging import configure_logging
from shared.runtime.process import THREAD_LIMITS
from shared.runtime.serve import run_id_of, stop_on_signals
from shared.telemetry.door import read_live_view

if TYPE_CHECKING:
    from services.jobs.dashboard import Dashboard

__all__ = ["TrainConfig", "main"]

log = structlog.get_logger()

POLL_SECONDS = 0.1
FREE_BYTES = 256 << 20
"""A run needs this much disk to begin with."""
LEAST_FREE_BYTES = 4 << 20
"""With less than this a run ends, while there is room for a last word."""
SPACE_SECONDS = 1.0
"""Period in which the free space is looked at."""
ROUTER_SECONDS = 60.0
"""How long the router may take to come up on a busy machine."""
HAND_OVER_SECONDS = 5.0
"""How long the end of a run waits for its last incidents to be entered."""
EXIT_INTERRUPTED = 130


class StopAsked(Exception):  # noqa: N818 - it is no error
    """The person at the terminal asked to stop."""


def main(argv: Sequence[str]) -> int:
    """Run one training job; return the exit code."""
    found = _parse(argv)
    overrides = _overrides(found)
    folder, run = _folder(found)
    settings = _settings(found, folder, overrides)
    with RunLock(folder):
        _check_folder(folder, resume=found.resume)
        require_free_space(folder, FREE_BYTES)
        atomic_write(folder / "config.toml", settings.to_toml().encode())
        _point_latest_at(folder)
        configure_logging(
            folder / "logs" / "train.jsonl", bound={"service": "train", "run_id": run}
        )
        # A signal ends the loop below; the deadline is for processes that will not stop.
        with stop_on_signals(deadline=180.0) as stop:
            try:
                if found.serial:
                    _train_serially(settings, folder, run, found.resume, stop)
                else:
                    _train(settings, folder, run, stop, view=found.view)
            except StopAsked:
                print(f"\nstopped; continue with: riposte train --resume --out {folder}")
                return EXIT_INTERRUPTED
        return _conclude(folder)


def _parse(argv: Sequence[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="riposte train", description="Train two fencers on this machine, with a report."
    )
    parser.add_argument("site", nargs="?", type=Path, metavar="SITE", help="site file (TOML)")
    parser.add_argument(
        "--phase", choices=("one",), default="one", help="which phase (%(default)s)"
    )
    parser.add_argument("--budget", choices=tuple(BUDGETS), help="how long (the site file's)")
    parser.add_argument("--actors", type=int, metavar="N", help="actor processes")
    parser.add_argument("--seed", type=int, metavar="S", help="of everything random")
    parser.add_argument("--out", type=Path, metavar="DIR", help="folder of the run")
    parser.add_argument("--resume", action="store_true", help="continue the run in --out")
    parser.add_argument("--serial", action="store_true", help="one process, same seed same bits")
    parser.add_argument("--view", action="store_true", help="open the live view in a browser")
    parser.add_argument(
        "--set", action="append", default=[], dest="overrides", metavar="SECTION.KEY=VALUE",
        help="over the site file; may be repeated",
    )  # fmt: skip
    return parser.parse_args(argv)


def _overrides(found: argparse.Namespace) -> list[str]:
    overrides = list(BUDGETS[found.budget]) if found.budget else []
    if found.actors is not None:
        overrides.append(f"train.actors={found.actors}")
    if found.seed is not None:
        overrides.append(f"train.seed={found.seed}")
    return [*overrides, *found.overrides]


def _folder(found: argparse.Namespace) -> tuple[Path, str]:
    """Return the run's folder and its name on the bus."""
    if found.out is not None:
        folder: Path = found.out
    elif found.resume:
        folder = Path("runs/latest")
        if not folder.exists():
            raise ConfigError("there is no run to resume in runs/latest; name it with --out DIR")
        folder = folder.resolve()
    else:
        stamp = datetime.datetime.now().strftime("%Y%m%d-%H%M%S")
        folder = Path("runs") / f"train-{stamp}"
    return folder, run_id_of(folder)


def _settings(found: argparse.Namespace, folder: Path, overrides: Sequence[str]) -> Settings:
    """Return the settings: those the run began with when resuming, else site file and flags."""
    saved = folder / "config.toml"
    if found.resume and saved.exists():
        if found.site is not None:
            raise ConfigError(f"--resume continues with {saved}; leave the site file out")
        return Settings.load(saved, overrides)
    return Settings.load(found.site, overrides)


def _check_folder(folder: Path, *, resume: bool) -> None:
    """Refuse to mix two runs.

    Raises:
        ConfigError: there is a run and ``resume`` is not asked for, or the other way round.
    """
    has_run = (folder / "league.sqlite").exists()
    if has_run and not resume:
        raise ConfigError(
            f"{folder} holds a run already; continue it with --resume, or choose another --out"
        )
    if resume and not has_run:
        raise ConfigError(f"{folder} holds no run to resume; leave --resume out to start one")


def _point_latest_at(folder: Path) -> None:
    """Let ``runs/latest`` be this run, when it lies in ``runs``."""
    if folder.parent.name != "runs":
        return
    link = folder.parent / "latest"
    with contextlib.suppress(OSError):
        if link.is_symlink() or not link.exists():
            temporary = link.with_name(f".latest.{os.getpid()}")
            temporary.symlink_to(folder.name)
            temporary.replace(link)


def _conclude(folder: Path) -> int:
    """Write the report and print what a person wants to know."""
    from services.jobs.report import summary_text, write_report

    summary = write_report(folder)
    print(summary_text(summary))
    return 0


# -- many processes ---------------------------------------------------------------------------


def processes(settings: Settings, folder: Path, run: str, endpoint: str) -> list[ProcessSpec]:
    """Return the processes of a run on this machine, in the order they are started."""

    def spec(role: str, name: str, **more: str) -> ProcessSpec:
        command = service_command(
            role, name=name, run=folder, site=folder / "config.toml", run_id=run,
            connect=() if role == "router" else (endpoint,), **more,
        )  # fmt: skip
        extra = ("--listen", endpoint) if role == "router" else ()
        return ProcessSpec(name, (*command, *extra))

    made = [spec("router", "router-0"), spec("league", "league-0")]
    # The antagonist learns first: its long imports begin first.
    made += [spec("learner", f"learner-{agent}", agent=agent) for agent in AGENTS]
    made += [spec("actor", f"actor-{index}") for index in range(settings.train.actors)]
    if settings.train.record:
        made.append(spec("recorder", "recorder-0"))
    return made


def _train(
    settings: Settings, folder: Path, run: str, stop: threading.Event, *, view: bool
) -> None:
    """Run the processes until the schedule is done."""
    from shared.bus.zenoh import open_zenoh

    clock = SystemClock()
    endpoint = _endpoint(settings.bus)
    atomic_write(folder / "endpoint.json", json.dumps({"connect": endpoint, "run": run}).encode())
    supervisor = Supervisor(processes(settings, folder, run, endpoint), folder / "logs", clock)
    try:
        started = supervisor.start()
        _wait_for_router(endpoint, supervisor, stop)
        bus_cfg = msgspec.structs.replace(settings.bus, connect=(endpoint,))
        with (
            contextlib.closing(open_zenoh(bus_cfg, "train", clock, run)) as bus,
            _dashboard(bus, clock, folder) as dashboard,
        ):
            watcher = _Watcher(bus, clock, supervisor, dashboard, folder)
            watcher.tell(started)
            while not watcher.finished:
                if stop.is_set():
                    raise StopAsked
                watcher.tick()
                if view and (live := read_live_view(folder)) is not None:
                    view = False
                    webbrowser.open(live.url)
                bus.wait(POLL_SECONDS)
            watcher.hand_over()
    finally:
        for event in supervisor.stop():
            log.info("process_stopped", process=event.name, exit_code=event.exit_code)
        (folder / "endpoint.json").unlink(missing_ok=True)


def _endpoint(cfg: BusConfig) -> str:
    """Return where the run's router listens: a free port, or where the site file says.

    Raises:
        ConfigError: another program listens there.
    """
    if cfg.listen == BusConfig().listen:  # runs side by side need a port each
        return f"tcp/127.0.0.1:{free_port()}"
    endpoint = cfg.listen[0]
    port = int(endpoint.rpartition(":")[2])
    if port and free_port(port) != port:
        raise ConfigError(
            f"bus.listen: {endpoint} is in use by another program; stop it, name another port, "
            "or leave bus.listen out to get a free one"
        )
    return endpoint


def _wait_for_router(endpoint: str, supervisor: Supervisor, stop: threading.Event) -> None:
    """Wait until the router accepts a connection.

    Raises:
        RiposteError: it was given up, or did not come up in time.
    """
    host, _, port = endpoint.partition("/")[2].rpartition(":")
    for _ in range(round(ROUTER_SECONDS / POLL_SECONDS)):
        if stop.is_set():
            raise StopAsked
        for event in supervisor.poll():
            if event.kind == "gave_up":
                raise RiposteError(f"{event.describe}\n{event.tail}".rstrip())
        with contextlib.suppress(OSError), socket.create_connection((host, int(port)), 1.0):
            return
        stop.wait(POLL_SECONDS)
    raise RiposteError(f"the router did not listen on {endpoint} within {ROUTER_SECONDS:g} s")


class _Watcher:
    """Follows a run: its schedule, its processes, what the report should mention."""

    def __init__(
        self,
        bus: Bus,
        clock: SystemClock,
        supervisor: Supervisor,
        dashboard: "Dashboard",
        folder: Path,
    ) -> None:
        self._bus = bus
        self._clock = clock
        self._supervisor = supervisor
        self._dashboard = dashboard
        self._folder = folder
        self._space_due_at = clock.now()
        self._schedule = bus.subscribe(SCHEDULE)
        self._incidents: Outbox[Incident, Receipt] = Outbox(
            bus, INCIDENT, clock, window=256, timeout=5.0
        )
        self._sequence = 0
        self.finished = False

    def tick(self) -> None:
        """Do one round.

        Raises:
            RiposteError: a process was given up, or the disk is full; the run can be resumed.
        """
        if (now := self._clock.now()) >= self._space_due_at:
            self._space_due_at = now + SPACE_SECONDS
            self._check_space()
        self.tell(self._supervisor.poll())
        self._incidents.pump()
        while (schedule := self._schedule.take()) is not None:
            self.finished = schedule.finished
        self._dashboard.tick(self._supervisor.restarts)

    def hand_over(self) -> None:
        """Give the league a moment to enter the last incidents."""
        deadline = self._clock.now() + HAND_OVER_SECONDS
        while self._incidents.unacknowledged and self._clock.now() < deadline:
            self._incidents.pump()
            self._bus.wait(POLL_SECONDS)

    def tell(self, events: Sequence[ProcessEvent]) -> None:
        """Log what happened to processes, and have the report mention what should not have."""
        for event in events:
            log.info(
                f"process_{event.kind}", process=event.name, pid=event.pid,
                exit_code=event.exit_code,
            )  # fmt: skip
            if event.kind in ("died", "restarted", "gave_up"):
                self._note(event)
                self._dashboard.say(event.describe)
            if event.kind == "gave_up":
                self._check_space()
                raise RiposteError(f"{event.describe}\n{event.tail}".rstrip())

    def _check_space(self) -> None:
        free = shutil.disk_usage(self._folder).free
        if free < LEAST_FREE_BYTES:
            raise RiposteError(
                f"no space left: {self._folder} has {free / (1 << 20):.1f} MiB free; nothing that "
                f"was learned is lost, free some and continue with: riposte train --resume "
                f"--out {self._folder}"
            )

    def _note(self, event: ProcessEvent) -> None:
        if self._incidents.full:
            return
        self._incidents.put(
            Incident(
                source="train",
                boot=self._bus.boot,
                sequence=self._sequence,
                kind=f"process_{event.kind}",
                detail=event.describe[:2000],
                at_ns=self._clock.wall_ns(),
            )
        )
        self._sequence += 1


@contextlib.contextmanager
def _dashboard(bus: Bus, clock: SystemClock, folder: Path) -> "Generator[Dashboard]":
    """Show where the run stands for as long as the block lasts."""
    from services.jobs.dashboard import Dashboard

    with Dashboard(bus, clock, folder) as dashboard:
        yield dashboard


# -- one process ------------------------------------------------------------------------------


def _train_serially(
    settings: Settings, folder: Path, run: str, resume: bool, stop: threading.Event
) -> None:
    """Run everything in this process until the schedule is done."""
    os.environ.update(THREAD_LIMITS)
    from services.jobs.serial import SerialRun

    with contextlib.closing(
        SerialRun(settings, folder, run, resume=resume, record=settings.train.record)
    ) as serial:
        bus = serial.join("train")
        with _dashboard(bus, SystemClock(), folder) as dashboard:
            while not serial.finished:
                if stop.is_set():
                    raise StopAsked
                serial.tick()
                dashboard.tick({})


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
