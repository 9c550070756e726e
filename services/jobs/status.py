"""`riposte status`: every process on every machine, who waits for whom, who has fallen silent."""

import argparse
import contextlib
import dataclasses
import json
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import msgspec
from rich.console import Console
from rich.live import Live

from services.jobs.roll_call import RollCall
from services.jobs.status_view import Snapshot, render
from shared.bus.config import BusConfig
from shared.bus.runs import find_run
from shared.clock import Clock, SystemClock
from shared.errors import ConfigError
from shared.messages.topics import STATUS
from shared.runtime.files import atomic_write
from shared.runtime.serve import ServeArgs, certificates_override, open_site_bus, run_id_of
from shared.runtime.stop import stop_on_signals

LISTEN_SECONDS = 2.3
"""Every process reports once a second; two reports tell its load."""
WATCH_SECONDS = 1.0
LATEST = Path("runs/latest")
OPEN_SECONDS = 3.0
"""A person waits for the answer."""
PIPE_WIDTH = 190
"""Columns of the table where nobody's terminal sets them."""
EXIT_NOBODY = 1


class Endpoint(msgspec.Struct, frozen=True, kw_only=True):
    """Where to find a run on the bus: ``endpoint.json`` in its folder."""

    connect: str
    run: str
    """Name of the run on the bus."""
    certificates: str = ""
    """Folder of the site's certificates; empty where it has none."""


def read_endpoint(folder: Path) -> Endpoint:
    """Return where the run in ``folder`` can be reached.

    Raises:
        ConfigError: no run is going there, or the file is damaged.
    """
    path = folder / "endpoint.json"
    try:
        return msgspec.json.decode(path.read_bytes(), type=Endpoint)
    except OSError as error:
        raise ConfigError(
            f"no run in {folder}: {path.name} is missing (riposte train writes it); "
            "name the run with --run DIR, or its bus with --connect tcp/HOST:PORT"
        ) from error
    except (ValueError, RecursionError) as error:
        raise ConfigError(f"{path} is damaged: {error}") from error


def write_endpoint(folder: Path, endpoint: Endpoint) -> None:
    """Say in ``folder`` where its run can be reached."""
    atomic_write(folder / "endpoint.json", msgspec.json.encode(endpoint))


def bus_args(found: argparse.Namespace, role: str) -> ServeArgs:
    """Return the bus identity of an onlooker.

    Args:
        found: parsed ``site``, ``run``, ``run_id``, ``connect`` and ``certificates``; without a
            site or an endpoint the run's own ``endpoint.json`` says where to look.
        role: also the start of the onlooker's name.

    Raises:
        ConfigError: nothing says where the bus is.
    """
    connect, run_id = tuple(found.connect), str(found.run_id)
    certificates = found.certificates
    if not connect and found.site is None:
        endpoint = read_endpoint(found.run)
        connect, run_id = (endpoint.connect,), run_id or endpoint.run
        certificates = certificates or endpoint.certificates
    return ServeArgs(
        role=role,
        site=found.site,
        name=f"{role}-{os.getpid()}",
        run=found.run,
        run_id=run_id or run_id_of(found.run),
        connect=connect,
        overrides=(
            f"bus.open_seconds={OPEN_SECONDS}",
            *certificates_override(certificates),
        ),
    )


def to_json(snapshot: Snapshot) -> dict[str, Any]:
    """Return the snapshot in builtins: what every process said, and what was made of it."""
    return {
        "services": [
            {
                **msgspec.to_builtins(heard.status),
                "silent_seconds": heard.silent_seconds,
                "cpu_percent": heard.cpu_percent,
                "policy_lags": heard.lags,
            }
            for heard in snapshot.processes
        ],
        "missing": msgspec.to_builtins(snapshot.missing),
        "progress": msgspec.to_builtins(snapshot.progress),
    }


def main(argv: Sequence[str]) -> int:
    """Run ``riposte status``; return 1 when nobody is there."""
    parser = argparse.ArgumentParser(prog="riposte status", description=__doc__)
    add_bus_arguments(parser)
    how = parser.add_mutually_exclusive_group()
    how.add_argument("--json", action="store_true", help="one JSON object, with everything")
    how.add_argument("--watch", action="store_true", help="go on, every second, until Ctrl-C")
    found = parser.parse_args(argv)
    clock = SystemClock()
    args = bus_args(found, "status")
    if not found.run_id and (found.connect or found.site) and found.run == LATEST:
        args = dataclasses.replace(args, run_id=_only_run(args, clock))
    with (
        contextlib.closing(open_site_bus(args, clock)) as bus,
        contextlib.closing(RollCall(bus, clock)) as call,
    ):
        if found.watch:
            return _watch(call)
        call.listen(LISTEN_SECONDS)
        snapshot = call.snapshot()
    if found.json:
        print(json.dumps(to_json(snapshot)))
    elif snapshot.services:
        _console().print(render(snapshot))
    else:
        print(f"nobody answers at {', '.join(args.connect) or args.site} for run {args.run_id!r}")
    return 0 if snapshot.services else EXIT_NOBODY


def _watch(call: RollCall) -> int:
    """Show who runs until a signal."""
    console = _console()
    with (
        stop_on_signals() as stop,
        Live(console=console, auto_refresh=False) as live,
    ):
        while not stop.is_set():
            call.listen(WATCH_SECONDS)
            live.update(render(call.snapshot()), refresh=console.is_terminal)
            if not console.is_terminal:
                console.print(render(call.snapshot()))
    return 0


def _console() -> Console:
    console = Console()
    if not console.is_terminal:
        console.width = PIPE_WIDTH
    return console


def _only_run(args: ServeArgs, clock: Clock) -> str:
    """Return the run that is on at a bus that was named without one.

    Raises:
        ConfigError: several are.
    """
    cfg = args.section("bus", BusConfig).with_endpoints(connect=args.connect)
    return find_run(cfg, args.name, clock, "operator", STATUS, LISTEN_SECONDS) or args.run_id


def add_bus_arguments(
    parser: argparse.ArgumentParser,
    run: Path | None = LATEST,
    about: str = "%(default)s",
) -> None:
    """Add what an onlooker needs to find a run: see ``bus_args``.

    Args:
        parser: of the command.
        run: folder of the run where none is named.
        about: says in the help which folder that is.
    """
    parser.add_argument("site", nargs="?", type=Path, metavar="SITE", help="site file (TOML)")
    parser.add_argument(
        "--run", type=Path, default=run, metavar="DIR", help=f"folder of the run ({about})"
    )  # fmt: skip
    parser.add_argument("--run-id", default="", help="name of the run on the bus")
    parser.add_argument(
        "--connect", action="append", default=[], metavar="ENDPOINT",
        help="bus endpoint, as in tcp/127.0.0.1:7447; may be repeated",
    )  # fmt: skip
    parser.add_argument(
        "--certificates", default="", metavar="DIR",
        help="folder of riposte certs (that of the site file)",
    )  # fmt: skip
