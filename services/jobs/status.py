"""`riposte status`: who runs, what they do, who waits for whom and how long."""

import argparse
import json
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import msgspec
from rich.console import Console
from rich.table import Table

from shared.bus.base import Bus
from shared.clock import Clock, SystemClock
from shared.errors import ConfigError
from shared.messages.live import Progress, ServiceStatus
from shared.messages.topics import PROGRESS, STATUS
from shared.runtime.files import atomic_write
from shared.runtime.serve import ServeArgs, certificates_override, open_site_bus, run_id_of

LISTEN_SECONDS = 1.5
"""Every process reports once a second."""
OPEN_SECONDS = 3.0
"""A person waits for the answer."""
PIPE_WIDTH = 160
"""Columns of the table where nobody's terminal sets them."""
EXIT_NOBODY = 1


class Endpoint(msgspec.Struct, frozen=True, kw_only=True):
    """Where to find a run on the bus: ``endpoint.json`` in its folder."""

    connect: str
    run: str
    """Name of the run on the bus."""
    certificates: str = ""
    """Folder of the site's certificates; empty where it has none."""


class Snapshot(msgspec.Struct, frozen=True, kw_only=True):
    """What was heard."""

    services: tuple[ServiceStatus, ...]
    progress: Progress | None = None


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


def listen(bus: Bus, clock: Clock, seconds: float = LISTEN_SECONDS) -> Snapshot:
    """Return what the services of the run say within ``seconds``."""
    statuses, progress = bus.subscribe(STATUS), bus.subscribe(PROGRESS)
    heard: dict[tuple[str, str], ServiceStatus] = {}
    newest: Progress | None = None
    until = clock.now() + seconds
    while (left := until - clock.now()) > 0:
        bus.wait(left)
        while (status := statuses.take()) is not None:
            heard[status.role, status.name] = status
        while (said := progress.take()) is not None:
            newest = said
    statuses.close()
    progress.close()
    return Snapshot(services=tuple(heard[key] for key in sorted(heard)), progress=newest)


def to_json(snapshot: Snapshot) -> dict[str, Any]:
    """Return the snapshot in builtins."""
    return msgspec.to_builtins(snapshot)


def headline(progress: Progress) -> str:
    """Return where the run stands, in one line."""
    parts = [f"{progress.run}: phase {progress.phase}"]
    if progress.iteration:
        parts.append(f"iteration {progress.iteration}")
    if progress.agent:
        parts += [
            f"stage {progress.stage + 1}/{progress.stages}",
            f"{progress.agent} learns",
            f"update {progress.update}/{progress.max_updates}",
        ]
    if progress.evaluations_total:
        parts.append(f"evaluations {progress.evaluations_done}/{progress.evaluations_total}")
    if progress.score_bouts:
        low, high = progress.score_low, progress.score_high
        parts.append(f"score {progress.score_mean:.0f} [{low:.0f}, {high:.0f}]")
    if progress.samples_per_s:
        parts.append(f"{progress.samples_per_s:.0f} samples/s")
        parts.append(f"policy lag {progress.policy_lag_mean:.2f}")
    if progress.dropped_rollouts:
        parts.append(f"dropped rollouts {progress.dropped_rollouts}")
    if progress.eta_seconds >= 0:
        minutes, rest = divmod(round(progress.eta_seconds), 60)
        parts.append(f"{minutes}:{rest:02d} left")
    return ", ".join(parts)


def table(snapshot: Snapshot) -> Table:
    """Return one row for each service."""
    made = Table(box=None, pad_edge=False, header_style="bold")
    made.add_column("service", no_wrap=True)
    made.add_column("state")
    made.add_column("waits for")
    made.add_column("rates", no_wrap=True)
    made.add_column("dropped", no_wrap=True)
    made.add_column("cpu", justify="right", no_wrap=True)
    made.add_column("memory", justify="right", no_wrap=True)
    made.add_column("last error", style="red")
    for status in snapshot.services:
        made.add_row(
            status.name,
            status.state,
            waits(status),
            "\n".join(f"{name} {value:,.0f}" for name, value in sorted(status.rates.items())),
            "\n".join(f"{name} {count}" for name, count in drops(status).items()),
            f"{status.cpu_seconds:.0f} s",
            f"{status.rss_bytes / 2**20:.0f} MiB",
            status.last_error,
        )
    return made


def waits(status: ServiceStatus) -> str:
    """Return whom a service waits for and since when."""
    if not status.waiting_for:
        return ""
    return f"{status.waiting_for} for {status.waiting_seconds:.1f} s"


def drops(status: ServiceStatus) -> dict[str, int]:
    """Return the counters that say something was lost or refused, those above zero."""
    words = ("drop", "refus", "lost", "reconnect")
    return {
        name: count
        for name, count in sorted(status.counters.items())
        if count > 0 and any(word in name for word in words)
    }


def main(argv: Sequence[str]) -> int:
    """Run ``riposte status``; return 1 when nobody is there."""
    parser = argparse.ArgumentParser(prog="riposte status", description=__doc__)
    add_bus_arguments(parser)
    parser.add_argument("--json", action="store_true", help="one JSON object")
    found = parser.parse_args(argv)
    clock = SystemClock()
    args = bus_args(found, "status")
    bus = open_site_bus(args, clock)
    try:
        snapshot = listen(bus, clock)
    finally:
        bus.close()
    if found.json:
        print(json.dumps(to_json(snapshot)))
    elif snapshot.services:
        if snapshot.progress is not None:
            print(headline(snapshot.progress))
        console = Console()
        if not console.is_terminal:
            console.width = PIPE_WIDTH
        console.print(table(snapshot))
    else:
        print(f"nobody answers at {', '.join(args.connect) or args.site} for run {args.run_id!r}")
    return 0 if snapshot.services else EXIT_NOBODY


def add_bus_arguments(
    parser: argparse.ArgumentParser,
    run: Path | None = Path("runs/latest"),
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
