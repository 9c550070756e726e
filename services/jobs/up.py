"""`riposte up`: starts the processes a site file lists for this machine and keeps them alive.

Where the league is on another machine, actors join its run as any `riposte actor` does.
"""

import argparse
import contextlib
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import get_args

import msgspec
import structlog

from services.supervisor import ProcessEvent, ProcessSpec, Supervisor, service_command
from shared.clock import SystemClock
from shared.config.site import load_section, nearest
from shared.messages.training import Agent
from shared.runtime.files import RunLock
from shared.runtime.logging import configure_logging
from shared.runtime.serve import run_id_of
from shared.runtime.stop import stop_on_signals

ROLES = (
    "router", "league", "learner", "actor", "recorder", "referee", "policy", "robot-io",
    "page", "metrics",
)  # fmt: skip
SIDED = ("learner", "policy")
"""Roles of which each process belongs to one agent."""
WRITERS = ("league", "learner")
"""Roles that own files of the run: only one machine, and one `up` on it, may start them."""
POLL_SECONDS = 0.1
EXIT_GAVE_UP = 1

log = structlog.get_logger()


class SiteConfig(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What `riposte up` starts on this machine."""

    processes: tuple[str, ...] = (
        "router", "league", "learner antagonist", "learner protagonist", "actor", "recorder",
    )  # fmt: skip
    """Roles in the order they are started, stopped in reverse; one may be listed several times."""

    def __post_init__(self) -> None:
        """Refuse what is not a role."""
        if not self.processes:
            raise ValueError("processes is empty: list at least one role")
        for entry in self.processes:
            role, _, agent = entry.partition(" ")
            if role not in ROLES:
                raise ValueError(f"processes has {entry!r}; {nearest(role, ROLES)}")
            if (role in SIDED) != (agent in get_args(Agent)):
                sided = role if role in SIDED else SIDED[0]
                raise ValueError(
                    f"processes has {entry!r}, expected '{sided} antagonist', "
                    f"'{sided} protagonist', or another role alone"
                )


def specs(
    cfg: SiteConfig, *, site: Path, run: Path, run_id: str, node: str, overrides: Sequence[str],
    join: str = "",
) -> list[ProcessSpec]:  # fmt: skip
    """Return the processes of ``cfg``, each with a name of its own on this machine.

    Args:
        cfg: what to start.
        site: site file they read.
        run: folder of the run.
        run_id: name of the run on the bus.
        node: stands before every name, so that machines do not share one; may be empty.
        overrides: passed on.
        join: name of the run that actors join where the league is elsewhere; empty: the one on.
    """
    made: list[ProcessSpec] = []
    joins = "league" not in cfg.processes
    for entry in cfg.processes:
        role, _, agent = entry.partition(" ")
        taken = sum(spec.name.startswith(f"{node}{role}-") for spec in made)
        name = f"{node}{role}-{agent or taken}"
        if role == "actor" and joins:
            own = name if node else ""  # else it takes one that no other machine has
            command = _joining(site, own, join, overrides)
            made.append(ProcessSpec(name, command, finishes=False))
            continue
        command = service_command(
            role.replace("-", "_"),
            name=name,
            run=run,
            site=site,
            run_id=run_id,
            agent=agent,
            overrides=overrides,
        )
        made.append(ProcessSpec(name, command, finishes=False))
    return made


def _joining(site: Path, name: str, run_id: str, overrides: Sequence[str]) -> tuple[str, ...]:
    """Return the command line of an actor that joins the run that is on."""
    command = [sys.executable, "-P", "-m", "services.actor", str(site.resolve())]
    command += ["--name", name] if name else []
    command += ["--run-id", run_id] if run_id else []
    return (*command, *(word for one in overrides for word in ("--set", one)))


def main(argv: Sequence[str]) -> int:
    """Run ``riposte up`` until a signal, or until no process is left."""
    parser = argparse.ArgumentParser(prog="riposte up", description=__doc__)
    parser.add_argument("site", type=Path, metavar="SITE", help="site file (TOML)")
    parser.add_argument(
        "--run", type=Path, default=Path("runs/latest"), metavar="DIR",
        help="folder of the run (%(default)s)",
    )  # fmt: skip
    parser.add_argument("--run-id", default="", help="name on the bus (the folder's name)")
    parser.add_argument("--node", default="", help="stands before every process's name")
    parser.add_argument(
        "--set", action="append", default=[], metavar="SECTION.KEY=VALUE", dest="overrides",
        help="over the site file; may be repeated",
    )  # fmt: skip
    found = parser.parse_args(argv)
    cfg = load_section(found.site, "site", SiteConfig, found.overrides)
    run_id = found.run_id or run_id_of(found.run)
    node = f"{found.node}-" if found.node else ""
    processes = specs(
        cfg, site=found.site, run=found.run, run_id=run_id, node=node, overrides=found.overrides,
        join=found.run_id,
    )  # fmt: skip
    owns = any(entry.startswith(WRITERS) for entry in cfg.processes)
    with RunLock(found.run) if owns else contextlib.nullcontext():
        logs = found.run / "logs"
        configure_logging(logs / f"{node}up.jsonl", bound={"service": "up", "run_id": run_id})
        return keep_up(Supervisor(processes, logs, SystemClock()))


def keep_up(supervisor: Supervisor) -> int:
    """Start, watch, stop; return 0, or 1 when a process was given up."""
    gave_up = False
    with stop_on_signals(deadline=600.0) as stop:
        try:
            tell(supervisor.start())
            while not stop.wait(POLL_SECONDS) and supervisor.is_needed:
                events = supervisor.poll()
                gave_up |= any(event.kind == "gave_up" for event in events)
                tell(events)
        finally:
            tell(supervisor.stop())
    return EXIT_GAVE_UP if gave_up else 0


def tell(events: Sequence[ProcessEvent]) -> None:
    """Print and log what happened to processes."""
    for event in events:
        print(event.describe, flush=True)
        log.info(
            f"process_{event.kind}", process=event.name, pid=event.pid, exit_code=event.exit_code
        )
