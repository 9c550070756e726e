"""Runs the processes of a run on this machine until its schedule is done, and says how it goes."""

import contextlib
import shutil
import socket
import threading
import webbrowser
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Protocol

import msgspec
import structlog

from services.jobs.status import Endpoint, write_endpoint
from services.supervisor import ProcessEvent, ProcessSpec, Supervisor
from shared.bus.base import Bus
from shared.bus.config import BusConfig
from shared.bus.ports import free_port
from shared.clock import Clock, SystemClock
from shared.errors import ConfigError, RiposteError
from shared.messages.topics import SCHEDULE, Role
from shared.runtime.incidents import Incidents
from shared.telemetry.door import read_live_view

log = structlog.get_logger()

PATIENCE = 3600.0
"""How long the parent goes without a router (s): it is the one who starts it again, and who says
when that is in vain."""
POLL_SECONDS = 0.1
LEAST_FREE_BYTES = 4 << 20
"""With less than this a run ends, while there is room for a last word."""
SPACE_SECONDS = 1.0
"""Period in which the free space is looked at."""
ROUTER_SECONDS = 60.0
"""How long the router may take to come up on a busy machine."""
HAND_OVER_SECONDS = 5.0
"""How long the end of a run waits for its last incidents to be entered."""
STARTING_SECONDS = 20.0
"""How long the end of a run waits for a process that is still starting."""


class StopAsked(Exception):  # noqa: N818 - it is no error
    """The person at the terminal asked to stop."""


class Display(Protocol):
    """Shows a person how the run goes."""

    def tick(self, restarts: Mapping[str, int]) -> None:
        """Draw what is new; ``restarts`` counts how often each process was started again."""
        ...

    def say(self, text: str) -> None:
        """Show an event."""
        ...


def run_processes(
    job: str,
    specs: Callable[[str], Sequence[ProcessSpec]],
    display: Callable[[Bus, Clock], AbstractContextManager[Display]],
    cfg: BusConfig,
    folder: Path,
    run: str,
    stop: threading.Event,
    *,
    again: str,
    view: bool = False,
    awaited: Sequence[Role] = (),
) -> None:
    """Start processes, watch them until the schedule is done, stop them in order.

    Args:
        job: name of this process on the bus and in incidents.
        specs: returns what to start, given the endpoint of the router, which comes first.
        display: shows how it goes.
        cfg: of the bus.
        folder: of the run.
        run: its name on the bus.
        stop: set when the person at the terminal asks to stop.
        again: the command that continues the run.
        view: open the live view in a browser.
        awaited: roles that are to have begun before a run ends, however short it is.

    Raises:
        StopAsked: ``stop`` was set.
        RiposteError: a process was given up, or the disk is full.
    """
    from shared.bus.zenoh import open_zenoh

    clock = SystemClock()
    endpoint = endpoint_of(cfg)
    write_endpoint(folder, Endpoint(connect=endpoint, run=run, certificates=cfg.certificates))
    supervisor = Supervisor(specs(endpoint), folder / "logs", clock)
    try:
        started = supervisor.start()
        wait_for_router(endpoint, supervisor, stop)
        bus_cfg = msgspec.structs.replace(cfg, connect=(endpoint,), give_up_seconds=PATIENCE)
        with (
            contextlib.closing(open_zenoh(bus_cfg, job, clock, run)) as bus,
            display(bus, clock) as shown,
        ):
            watcher = _Watcher(bus, clock, supervisor, shown, folder, again)
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
            watcher.await_begun(awaited)
    finally:
        for event in supervisor.stop():
            log.info("process_stopped", process=event.name, exit_code=event.exit_code)
        (folder / "endpoint.json").unlink(missing_ok=True)


def endpoint_of(cfg: BusConfig) -> str:
    """Return where this machine's processes reach the router: a free port, or by the site file.

    Raises:
        ConfigError: another program listens there.
    """
    if cfg.listen == BusConfig().listen:  # runs side by side need a port each
        return f"{cfg.local_protocol}/127.0.0.1:{free_port()}"
    endpoint = cfg.listen[0]
    port = int(endpoint.rpartition(":")[2])
    if port and free_port(port) != port:
        raise ConfigError(
            f"bus.listen: {endpoint} is in use by another program; stop it, name another port, "
            "or leave bus.listen out to get a free one"
        )
    return endpoint


def listen_words(cfg: BusConfig, endpoint: str) -> tuple[str, ...]:
    """Return where a router listens, on its command line: at every endpoint of the site file.

    Args:
        cfg: of the bus.
        endpoint: of ``endpoint_of``, where the processes of this machine reach it.
    """
    others = cfg.listen[1:] if cfg.listen[:1] == (endpoint,) else ()
    return tuple(word for one in (endpoint, *others) for word in ("--listen", one))


def wait_for_router(endpoint: str, supervisor: Supervisor, stop: threading.Event) -> None:
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
        clock: Clock,
        supervisor: Supervisor,
        display: Display,
        folder: Path,
        again: str,
    ) -> None:
        self._bus = bus
        self._clock = clock
        self._supervisor = supervisor
        self._display = display
        self._folder = folder
        self._again = again
        self._space_due_at = clock.now()
        self._schedule = bus.subscribe(SCHEDULE)
        self._incidents = Incidents(bus, clock, window=256)
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
        self._display.tick(self._supervisor.restarts)

    def hand_over(self) -> None:
        """Give the league a moment to enter the last incidents."""
        deadline = self._clock.now() + HAND_OVER_SECONDS
        while self._incidents.unacknowledged and self._clock.now() < deadline:
            self._incidents.pump()
            self._bus.wait(POLL_SECONDS)

    def await_begun(self, roles: Sequence[Role]) -> None:
        """Give processes that are still starting the time to begin their files.

        Raises:
            RiposteError: see ``tick``.
        """
        deadline = self._clock.now() + STARTING_SECONDS
        while not all(map(self._bus.alive, roles)) and self._clock.now() < deadline:
            self.tick()
            self._bus.wait(POLL_SECONDS)

    def tell(self, events: Sequence[ProcessEvent]) -> None:
        """Log what happened to processes, and have the report mention what should not have."""
        for event in events:
            log.info(
                f"process_{event.kind}", process=event.name, pid=event.pid,
                exit_code=event.exit_code,
            )  # fmt: skip
            if event.kind in ("died", "restarted", "gave_up"):
                self._incidents.note(f"process_{event.kind}", event.describe[:2000])
                self._display.say(event.describe)
            if event.kind == "gave_up":
                self._check_space()
                raise RiposteError(f"{event.describe}\n{event.tail}".rstrip())

    def _check_space(self) -> None:
        free = shutil.disk_usage(self._folder).free
        if free < LEAST_FREE_BYTES:
            raise RiposteError(
                f"no space left: {self._folder} has {free / (1 << 20):.1f} MiB free; nothing that "
                f"was entered is lost, free some and continue with: {self._again}"
            )
