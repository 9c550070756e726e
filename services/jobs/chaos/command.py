"""`riposte chaos`: injects named faults into running jobs and says what they cost.

Each fault strikes a real run at random moments; afterwards what was acknowledged is compared with
the ledger, name by name, and the time is taken until the rate is full again. What was injected is
kept in ``--out``, so that the same command goes on where it was interrupted.
"""

import argparse
import threading
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import msgspec
from rich.console import Console

from services.jobs.bench import describe_machine
from services.jobs.chaos.campaign import Campaign, Plan
from services.jobs.chaos.records import Records
from services.jobs.chaos.sites import FAULTS, KINDS, ROBOT, SITES, Site
from services.jobs.chaos.table import Row, markdown, rich_table, rows_of, summary, write_block
from shared.clock import SystemClock
from shared.config.site import nearest
from shared.errors import ConfigError
from shared.runtime.build import SOURCE_ROOT
from shared.runtime.files import RunLock
from shared.runtime.stop import stop_on_signals

PAGE = Path("docs/reliability.md")
TIMES = 20
STOP_SECONDS = 30.0
EXIT_HARM = 1
EXIT_INTERRUPTED = 130
LAST_SECONDS = 120.0
"""From Ctrl-C to the end, whatever a run is doing."""


def main(argv: Sequence[str]) -> int:
    """Inject faults; return 1 when something was harmed."""
    found = _parse(argv)
    if found.list:
        print("\n".join(f"{kind.name:<22} {kind.strikes}: {kind.what}" for kind in KINDS))
        return 0
    for name in found.faults:
        if name not in FAULTS:
            raise ConfigError(f"there is no fault {name!r}; {nearest(name, FAULTS)}")
    console = Console(stderr=found.json, highlight=False)
    skipped: dict[str, str] = {}
    with RunLock(found.out), stop_on_signals(deadline=LAST_SECONDS) as stop:
        records = Records(found.out)
        chosen = set(found.faults or FAULTS)
        for site in SITES:
            if not stop.is_set():
                skipped |= _strike(site, chosen, found, records, console, stop)
    for name, why in skipped.items():
        console.print(f"{name} skipped: {why}")
    return _conclude(records, found, skipped, console, is_whole=not stop.is_set())


def _parse(argv: Sequence[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="riposte chaos", description=__doc__)
    parser.add_argument("faults", nargs="*", metavar="FAULT", help="which; none: all of them")
    parser.add_argument("--list", action="store_true", help="name the faults")
    parser.add_argument(
        "--times", type=int, default=TIMES, metavar="N",
        help="injections of each, those in --out counted in (%(default)s; 0: only the table)",
    )  # fmt: skip
    parser.add_argument("--seed", type=int, default=0, metavar="S", help="of moments and choices")
    parser.add_argument(
        "--out", type=Path, default=Path("runs/chaos"), metavar="DIR",
        help="what was injected is kept here, with the runs (%(default)s)",
    )  # fmt: skip
    parser.add_argument(
        "--stop-seconds", type=float, default=STOP_SECONDS, metavar="T",
        help="how long SIGSTOP lasts (%(default)s s)",
    )  # fmt: skip
    parser.add_argument("--json", action="store_true", help="end with one JSON object")
    parser.add_argument("--write", action="store_true", help=f"put the table into {PAGE}")
    found = parser.parse_args(argv)
    if not 0 <= found.times <= 10_000:
        raise ConfigError(f"--times is {found.times}; it may be 0 to 10000")
    if not 0.1 <= found.stop_seconds <= 600.0:
        raise ConfigError(f"--stop-seconds is {found.stop_seconds:g}; it may be 0.1 to 600 s")
    return found


def _strike(
    site: Site, chosen: set[str], found: argparse.Namespace, records: Records, console: Console,
    stop: threading.Event,
) -> dict[str, str]:  # fmt: skip
    """Inject a site's faults; return those that cannot be, with the reason."""
    faults = [fault for fault in site.faults if fault.name in chosen]
    plan = Plan(faults, found.times, records, found.seed)
    if not len(plan):
        return {}
    if why := site.why_not():
        return {fault.name: why for fault in faults}
    total = len(plan)
    clock = SystemClock()
    began = clock.now()

    def say(text: str) -> None:
        done, seconds = total - len(plan), clock.now() - began
        console.print(f"{seconds:6.0f} s {done:>4}/{total} {text}", markup=False, soft_wrap=True)

    folder = found.out.resolve() / site.name
    folder.mkdir(parents=True, exist_ok=True)
    with site.prepare(folder, clock) as make:
        Campaign(
            site.name, make, folder, records, plan, clock, say, seed=found.seed,
            stop_seconds=found.stop_seconds, is_kept=site.is_kept,
        ).run(stop.is_set)  # fmt: skip
    return {}


def _conclude(
    records: Records, found: argparse.Namespace, skipped: dict[str, str], console: Console, *,
    is_whole: bool,
) -> int:  # fmt: skip
    """Show the table, write it where that was asked for; return the exit code."""
    rows = rows_of(KINDS, records.injections, ROBOT)
    said = summary(records.injections, records.jobs)
    if found.json:
        print(msgspec.json.encode(_plain(rows, said, skipped)).decode())
    else:
        console.print(rich_table(rows))
        console.print(said)
    if found.write:
        machine = describe_machine((0.0, 0.0, 0.0))
        loads = [injection.load for injection in records.injections if injection.load]
        busy = f", load average per core {min(loads):.1f} to {max(loads):.1f}" if loads else ""
        where = f"Measured on {machine.cores} x {machine.name}, Python {machine.python}{busy}."
        write_block(SOURCE_ROOT / PAGE, markdown(rows, said, where))
    if not is_whole:
        return EXIT_INTERRUPTED
    is_harmless = all(row.is_harmless for row in rows)
    return 0 if is_harmless and all(job.finished for job in records.jobs) else EXIT_HARM


def _plain(rows: Sequence[Row], said: str, skipped: dict[str, str]) -> dict[str, Any]:
    return {"rows": [msgspec.to_builtins(row) for row in rows], "said": said, "skipped": skipped}
