"""``python -m services.study``: the process that runs one participant's session of a study."""

import json
import os
import sys
import threading
from collections.abc import Sequence
from pathlib import Path

import structlog

from services.study.config import StudyConfig
from services.study.course import Terms
from services.study.lsl import LslOutlet
from services.study.opening import plan_of
from services.study.service import Study, asks_of
from services.study.web import Web, drop_token, token_of
from shared.bus.base import Bus
from shared.clock import Clock
from shared.errors import ConfigError
from shared.runtime.files import atomic_write
from shared.runtime.serve import ServeArgs, serve
from shared.runtime.service import StatusReporter
from shared.study.folder import open_study
from shared.study.journal import Journal
from shared.study.recorded import write_participants, write_session

FILE = "study.json"
"""In the session's folder: where its pages are; only its owner may read it."""
PACE = 0.02
"""From one look at the bus to the next: it says some 300 things a second (s)."""

log = structlog.get_logger()


def build(args: ServeArgs, bus: Bus, clock: Clock) -> Study:
    """Return the session that the command line asks for; it serves its pages from now on."""
    cfg = args.section("study", StudyConfig)
    if not cfg.folder:
        raise ConfigError("study.folder is empty: start this with `riposte study run DIR`")
    study = open_study(Path(cfg.folder))
    plan = plan_of(study, cfg, args.site.read_bytes() if args.site is not None else b"")
    folder = study.session_folder(plan.participant, plan.session)

    def write_tables() -> None:
        write_session(study, plan.participant, plan.session)
        write_participants(study)

    terms = Terms(
        countdown=cfg.countdown, score_seconds=cfg.score_seconds,
        needs_recorder=cfg.needs_recorder, has_heart_rate=cfg.has_heart_rate,
    )  # fmt: skip
    journal = Journal(folder, clock)
    window: Web | None = None
    try:
        asks = asks_of(journal)
        window = Web(cfg.host, cfg.port, cfg.origins, token=token_of(folder), asks=asks)
        outlet = LslOutlet(plan.participant, plan.session) if cfg.lsl else None
        service = Study(
            plan, folder, terms, journal, asks, window, write_tables, bus, clock, outlet
        )
        write_place(args.run, window)
    except BaseException:
        journal.close()
        if window is not None:
            window.close()
        raise
    log.info("study_served", participant=plan.participant, url=window.participant_url)
    return service


def write_place(folder: Path, window: Web) -> None:
    """Say in the run's folder where the pages are."""
    place = {
        "researcher": window.researcher_url, "participant": window.participant_url,
        "pid": os.getpid(),
    }  # fmt: skip
    atomic_write(folder / FILE, json.dumps(place).encode(), mode=0o600)


def run(service: Study, bus: Bus, clock: Clock, args: ServeArgs, stop: threading.Event) -> None:
    """Look at the bus at an even pace until ``stop`` is set."""
    try:
        bus.declare_alive(args.role)
        reporter = StatusReporter(service, bus, clock, args.role, args.log_path)
        while not stop.wait(PACE):
            bus.wait(0.0)
            service.tick()
            reporter.tick()
    finally:
        (args.run / FILE).unlink(missing_ok=True)
        if service.session.is_over:
            drop_token(service.folder)


def main(argv: Sequence[str] | None = None) -> int:
    """Run the session until told to stop; return the exit code."""
    return serve("study", build, argv, loop=run)


if __name__ == "__main__":
    sys.exit(main())
