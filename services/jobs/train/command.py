"""`riposte train`: two fencers on this machine, from fresh policies to a report.

Starts router, league, two learners, recorder and actors, watches them, shows where the run
stands, and ends with the report. ``--serial`` runs the same services in one process.
"""

import contextlib
import dataclasses
import os
import sys
import threading
import time
from collections.abc import Generator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import structlog

from services.jobs import commands
from services.jobs.runs import state_of
from services.jobs.settings import Settings, TrainConfig
from services.jobs.train import pipeline
from services.jobs.train.arguments import (
    check_folder,
    folder_of,
    is_over,
    parse,
    settings_of,
)
from services.jobs.train.processes import StopAsked, listen_words, run_processes
from services.supervisor import ProcessSpec, service_command
from shared.bus.base import Bus
from shared.clock import Clock, SystemClock
from shared.messages.training import AGENTS
from shared.runtime.files import RunLock, atomic_write, require_free_space
from shared.runtime.logging import configure_logging
from shared.runtime.stop import stop_on_signals

if TYPE_CHECKING:
    from services.jobs.train.dashboard import Dashboard

__all__ = ["TrainConfig", "main"]

log = structlog.get_logger()

FREE_BYTES = 256 << 20
"""A run needs this much disk to begin with."""
EXIT_INTERRUPTED = 130


def main(argv: Sequence[str]) -> int:
    """Run one training job; return the exit code."""
    found = parse(argv)
    folder, run = folder_of(found)
    settings = settings_of(found, folder)
    if found.phase == "two":  # before a folder is made where there is no run
        check_folder(found, folder, settings)
    with RunLock(folder):
        check_folder(found, folder, settings)
        require_free_space(folder, FREE_BYTES)
        atomic_write(folder / "config.toml", settings.to_toml().encode())
        if found.phase == "all" and not pipeline.is_begun(folder):
            pipeline.write(folder, pipeline.Pipeline())
        over = found.resume and is_over(folder, settings)
        if not over:
            commands.note(folder, ["train", *argv])
        _point_latest_at(folder)
        configure_logging(
            folder / "logs" / "train.jsonl", bound={"service": "train", "run_id": run}
        )
        # A signal ends the loop below; the deadline is for processes that will not stop.
        with stop_on_signals(deadline=180.0) as stop:
            try:
                if over:
                    log.info("run_over", folder=str(folder))
                elif found.serial:
                    _train_serially(settings, folder, run, found.resume, stop)
                else:
                    _train(settings, folder, run, stop, view=found.view)
            except StopAsked:
                print(f"\nstopped; continue with: riposte train --resume --out {folder}")
                return EXIT_INTERRUPTED
        began = time.monotonic()
        code = _conclude(folder)
        report_seconds = time.monotonic() - began
        is_whole = found.phase == "all" or (found.phase is None and pipeline.is_begun(folder))
        if code or not is_whole:
            return code
        position = state_of(folder).position
    # Each of these takes the locks it needs.
    code = pipeline.run_jobs(folder, position, report_seconds=report_seconds)
    return code or _conclude(folder)


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
    from services.jobs.report.command import summary_text, write_report

    summary = write_report(folder)
    print(summary_text(summary))
    return 0


# -- many processes ---------------------------------------------------------------------------


LATER = ("nice", "-n", "5")
"""What a run does not wait for yields the cores to what it does: its imports take 2 CPU seconds."""


def processes(settings: Settings, folder: Path, run: str, endpoint: str) -> list[ProcessSpec]:
    """Return the processes of a run on this machine, in the order they are started."""

    def spec(role: str, name: str, **more: str) -> ProcessSpec:
        command = service_command(
            role, name=name, run=folder, site=folder / "config.toml", run_id=run,
            connect=() if role == "router" else (endpoint,), **more,
        )  # fmt: skip
        extra = listen_words(settings.bus, endpoint) if role == "router" else ()
        return ProcessSpec(name, (*command, *extra), finishes=False)

    made = [spec("router", "router-0"), spec("league", "league-0")]
    # The antagonist learns first: its long imports begin first.
    made += [spec("learner", f"learner-{agent}", agent=agent) for agent in AGENTS]
    made += [spec("actor", f"actor-{index}") for index in range(settings.train.actors)]
    if settings.train.record:
        recorder = spec("recorder", "recorder-0")
        made.append(dataclasses.replace(recorder, argv=(*LATER, *recorder.argv)))
    return made


def _train(
    settings: Settings, folder: Path, run: str, stop: threading.Event, *, view: bool
) -> None:
    """Run the processes until the schedule is done."""
    run_processes(
        "train",
        lambda endpoint: processes(settings, folder, run, endpoint),
        lambda bus, clock: _dashboard(bus, clock, folder),
        settings.bus,
        folder,
        run,
        stop,
        again=f"riposte train --resume --out {folder}",
        view=view,
        awaited=("recorder",) if settings.train.record else (),
    )


@contextlib.contextmanager
def _dashboard(bus: Bus, clock: Clock, folder: Path) -> "Generator[Dashboard]":
    """Show where the run stands for as long as the block lasts."""
    from services.jobs.train.dashboard import Dashboard

    with Dashboard(bus, clock, folder) as dashboard:
        yield dashboard


# -- one process ------------------------------------------------------------------------------


def _train_serially(
    settings: Settings, folder: Path, run: str, resume: bool, stop: threading.Event
) -> None:
    """Run everything in this process until the schedule is done."""
    from services.jobs.train.serial import SerialRun

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
