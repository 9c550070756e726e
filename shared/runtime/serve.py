"""The frame of every service process: arguments, log, signals, bus, end.

Exit codes: 0 told to stop; 1 did not stop in time; 2 bad input, do not start me again; 70 a bug;
75 the bus was lost, start me again.
"""

import argparse
import contextlib
import dataclasses
import json
import os
import re
import sys
import threading
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TypeVar, get_args

import msgspec
import structlog

from shared.bus.base import Bus
from shared.bus.keys import check_chunk
from shared.clock import Clock, SystemClock
from shared.config.site import load_section
from shared.errors import BusError, RiposteError
from shared.messages.topics import SERVICE_ROLES, Role
from shared.messages.training import Agent
from shared.runtime.build import commit
from shared.runtime.logging import configure_logging
from shared.runtime.process import set_process_name
from shared.runtime.service import Ticking, run, version
from shared.runtime.stop import stop_on_signals

EXIT_BAD_INPUT = 2
EXIT_BUG = 70
EXIT_BUS_LOST = 75

S = TypeVar("S", bound=msgspec.Struct)
T = TypeVar("T", bound=Ticking)
log = structlog.get_logger()


@dataclasses.dataclass(frozen=True)
class ServeArgs:
    """Who a process is: what its command line said."""

    role: str
    site: Path | None
    """Site file; None for defaults."""
    name: str
    """Unique in the run: ``actor-0``."""
    run: Path
    """Folder of the run."""
    run_id: str
    """Name of the run on the bus."""
    connect: tuple[str, ...] = ()
    """Endpoints of the bus, over those of the site file."""
    agent: Agent | None = None
    """Whose learner this is."""
    overrides: tuple[str, ...] = ()
    """``section.key=value``, over the site file."""

    @property
    def log_path(self) -> Path:
        """Return the process's log file."""
        return self.run / "logs" / f"{self.name}.jsonl"

    def section(self, name: str, type: type[S]) -> S:
        """Return a section of the site file with this process's overrides.

        Raises:
            ConfigError: see ``load_section``.
        """
        return load_section(self.site, name, type, self.overrides)


Build = Callable[[ServeArgs, Bus, Clock], T]
OpenBus = Callable[[ServeArgs, Clock], Bus]
Loop = Callable[[T, Bus, Clock, ServeArgs, threading.Event], None]


def run_id_of(folder: Path) -> str:
    """Return the name of a run on the bus: its folder's name, in letters a key may have."""
    plain = re.sub(r"[^A-Za-z0-9._-]+", "-", folder.resolve().name).strip("-._")
    return plain[:64] or "run"


def parse_args(role: str, argv: Sequence[str]) -> ServeArgs:
    """Return who this process is; exits with 2 and one line on a bad command line."""
    parser = argparse.ArgumentParser(
        prog=f"riposte {role}", description=f"Runs one {role} process until it is told to stop."
    )
    parser.add_argument("site", nargs="?", type=Path, metavar="SITE", help="site file (TOML)")
    parser.add_argument("--name", default=f"{role}-0", help="unique in the run (%(default)s)")
    parser.add_argument(
        "--run",
        type=Path,
        default=Path("runs/latest"),
        metavar="DIR",
        help="folder of the run (%(default)s)",
    )
    parser.add_argument("--run-id", default="", help="name on the bus (the folder's name)")
    parser.add_argument(
        "--connect",
        action="append",
        default=[],
        metavar="ENDPOINT",
        help="bus endpoint, as in tcp/127.0.0.1:7447; may be repeated",
    )
    parser.add_argument(
        "--certificates",
        default="",
        metavar="DIR",
        help="folder of riposte certs (that of the site file)",
    )
    parser.add_argument("--agent", choices=get_args(Agent), help="whose learner this is")
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="SECTION.KEY=VALUE",
        dest="overrides",
        help="over the site file; may be repeated",
    )
    found = parser.parse_args(argv)
    try:
        check_chunk("--name", found.name)
        check_chunk("--run-id", found.run_id or "run")
    except ValueError as error:
        parser.error(str(error))
    return ServeArgs(
        role=role,
        site=found.site,
        name=found.name,
        run=found.run,
        run_id=found.run_id or run_id_of(found.run),
        connect=tuple(found.connect),
        agent=found.agent,
        overrides=(*found.overrides, *certificates_override(found.certificates)),
    )


def certificates_override(folder: str) -> tuple[str, ...]:
    """Return ``--certificates`` as what it says over the site file; empty says nothing."""
    return (f"bus.certificates={json.dumps(folder)}",) if folder else ()


def role_of(role: str) -> Role:
    """Return whose certificate a process shows: a service its own, a command the operator's."""
    own: dict[str, Role] = {one: one for one in SERVICE_ROLES}
    return own.get(role.replace("-", "_"), "operator")


def open_site_bus(args: ServeArgs, clock: Clock) -> Bus:
    """Return a session on the bus of ``args``.

    Raises:
        BusError: no router answers.
        ConfigError: the bus's section or an endpoint is wrong.
    """
    from shared.bus.config import BusConfig  # the session and its library: only where one is opened
    from shared.bus.zenoh import open_zenoh

    cfg = args.section("bus", BusConfig).with_endpoints(connect=args.connect)
    return open_zenoh(cfg, args.name, clock, args.run_id, role_of(args.role))


def plain_loop(
    service: Ticking, bus: Bus, clock: Clock, args: ServeArgs, stop: threading.Event
) -> None:
    """Tick until ``stop`` is set, as ``run`` says."""
    run(service, bus, clock, args.role, stop, args.log_path)


def serve(
    role: str,
    build: Build[T],
    argv: Sequence[str] | None = None,
    *,
    open_bus: OpenBus = open_site_bus,
    loop: Loop[T] = plain_loop,
) -> int:
    """Run one service process until it is told to stop; return its exit code.

    Args:
        role: ``actor``, ``learner``, ...
        build: makes the service; it may raise ``RiposteError`` for bad input.
        argv: command line without the program; ``sys.argv`` when None.
        open_bus: opens the session.
        loop: ticks the service until the event is set.
    """
    clock = SystemClock()

    def body(args: ServeArgs, stop: threading.Event) -> None:
        with (
            contextlib.closing(open_bus(args, clock)) as bus,
            contextlib.closing(build(args, bus, clock)) as service,
        ):
            log.info("service_started", pid=os.getpid(), boot=bus.boot)
            loop(service, bus, clock, args, stop)

    return serve_plain(role, body, argv)


def serve_plain(
    role: str,
    body: Callable[[ServeArgs, threading.Event], None],
    argv: Sequence[str] | None = None,
) -> int:
    """Run a process that keeps its own loop, such as the router; return its exit code.

    ``body`` must return soon after the event is set.
    """
    args = parse_args(role, sys.argv[1:] if argv is None else argv)
    set_process_name(args.name)
    log_path = args.log_path
    try:
        configure_logging(
            log_path, bound={"service": args.name, "run_id": args.run_id, "commit": commit()}
        )
    except OSError as error:
        return _say(args, f"cannot write {log_path}: {error.strerror or error}", EXIT_BAD_INPUT)
    try:
        with stop_on_signals() as stop:
            body(args, stop)
    except BusError as error:
        log.error("bus_lost", reason=str(error))
        return _say(args, str(error), EXIT_BUS_LOST)
    except RiposteError as error:
        log.error("service_refused", reason=str(error))
        return _say(args, str(error), EXIT_BAD_INPUT)
    except Exception as error:  # the edge of the process: the supervisor takes it from here
        log.critical("service_crashed", exc_info=True, version=version())
        what = f"{type(error).__name__}: {error}".splitlines()[0]
        return _say(args, f"bug: {what} (traceback in {log_path})", EXIT_BUG)
    log.info("service_stopped")
    return 0


def _say(args: ServeArgs, text: str, code: int) -> int:
    with contextlib.suppress(
        OSError
    ):  # where stderr is a file on a full disk, the code still tells
        sys.stderr.write(f"{args.name}: {text}\n")
    return code
