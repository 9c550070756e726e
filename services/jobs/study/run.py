"""`riposte study run`: one participant's session, from the welcome to the debrief.

Starts what `riposte play` starts and the study's own service, which leads the session; a session
that was begun before goes on where its journal ends.
"""

import argparse
import importlib.util
import os
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

import msgspec
from rich.console import Console

from services.jobs.plain import printable
from services.jobs.play.command import FREE_BYTES, Course
from services.jobs.play.plan import LAPTOP, Plan, override
from services.jobs.play.plan import parse as parse_play
from services.jobs.play.plan import plan_of as play_plan_of
from services.jobs.play.seats import PERSON
from services.jobs.study.hosting import StudyHost
from services.jobs.study.players import seats_of
from services.robot_io.heart_rate.source import HeartRateConfig
from services.study.config import StudyConfig
from services.study.course import STATIC
from shared.bus.ports import free_port
from shared.clock import Clock, SystemClock
from shared.config.site import load_section
from shared.errors import ConfigError, StudyError
from shared.runtime.files import RunLock, atomic_write, require_free_space
from shared.runtime.logging import configure_logging
from shared.runtime.serve import run_id_of
from shared.runtime.stop import stop_on_signals
from shared.study.dates import FLAG, date_problem, latest_known
from shared.study.folder import Study, hash_of, open_study
from shared.study.instants import clock_problem
from shared.study.journal import read_journal
from shared.study.progress import Progress, replay
from shared.study.recorded import write_participants, write_session

EXIT_ABORTED = 1
STOP_SECONDS = 180.0
"""Longest wait for processes that will not stop."""


def parse(argv: Sequence[str]) -> argparse.Namespace:
    """Return the words of a command line."""
    parser = argparse.ArgumentParser(prog="riposte study run", description=__doc__)
    parser.add_argument("folder", type=Path, metavar="DIR", help="the study's")
    parser.add_argument("--participant", required=True, metavar="ID", help="as in sub-01")
    parser.add_argument(
        "--site", type=Path, metavar="SITE", help="site file (TOML); none: a simulated PR2"
    )
    parser.add_argument(
        "--antagonist", metavar="WHO",
        help="who plays against the robot: mouse (the default), vive, replay; for a rehearsal "
        "scripted:NAME",
    )  # fmt: skip
    parser.add_argument("--port", type=int, metavar="N", help="of the pages (8770, or a free one)")
    parser.add_argument(
        FLAG, action="store_true", dest="is_clock_right",
        help="go on though the dates in the study's folder say that the clock is wrong",
    )  # fmt: skip
    parser.add_argument("--no-browser", action="store_true", help="only print the addresses")
    parser.add_argument(
        "--set", action="append", default=[], dest="overrides", metavar="SECTION.KEY=VALUE",
        help="over the site file; may be repeated",
    )  # fmt: skip
    return parser.parse_args(argv)


def main(argv: Sequence[str]) -> int:
    """Run a session; return 0 when it ended, 1 when it was aborted, 130 when it was stopped."""
    found = parse(argv)
    clock = SystemClock()
    study = open_study(found.folder)
    progress = progress_of(study, found.participant, clock, is_clock_right=found.is_clock_right)
    plan = plan_of(study, found)
    console = Console()
    name = found.participant
    with RunLock(plan.folder / "logs"), Path(os.devnull).open("w") as nowhere:
        require_free_space(plan.folder, FREE_BYTES)
        data = plan.settings.encode()
        atomic_write(plan.folder / "config.toml", data)
        atomic_write(plan.folder / f"config-{hash_of(data)[:12]}.toml", data)
        configure_logging(
            plan.folder / "logs" / "run.jsonl", console=nowhere,
            bound={"service": "study-run", "run_id": plan.run},
        )  # fmt: skip
        if progress.state != "new":
            text = f"{name} goes on where it was {spoken(progress)}"
            console.print(text, highlight=False, markup=False)
        host = StudyHost(plan, study.protocol.title, name, browser=not found.no_browser)
        with stop_on_signals(deadline=STOP_SECONDS) as stop:
            code = Course(
                plan, console, stop, browser=not found.no_browser, host=host
            ).run()  # fmt: skip
        write_session(study, name)
        write_participants(study)
    progress = replay(read_journal(plan.folder))
    text = ending_text(plan, study, progress, name)
    console.print(text, highlight=False, markup=False, soft_wrap=True)
    return EXIT_ABORTED if progress.state == "aborted" else code


def progress_of(
    study: Study, participant: str, clock: Clock, *, is_clock_right: bool = False
) -> Progress:
    """Return where a participant's session stands before it is run.

    Args:
        study: whose session it is.
        participant: who is to play.
        clock: the rows will be dated by it.
        is_clock_right: a person says so, whatever dates the study's folder has.

    Raises:
        StudyError: nobody of that name is expected, they have played already, or the clock of
            this machine cannot be right.
    """
    study.steps_of(participant)
    folder = study.session_folder(participant)
    events = read_journal(folder)
    progress = replay(events)
    if progress.state == "ended":
        raise StudyError(
            f"{participant} has played already ({folder}): everybody plays once; name the next "
            "participant of the allocation"
        )
    last = events[-1].wall_ns if events else 0
    now = clock.wall_ns()
    problem = clock_problem(now, last)
    if problem is None and not is_clock_right:
        problem = date_problem(now, latest_known(study))
    if problem is not None:
        raise StudyError(problem)
    return progress


def plan_of(study: Study, found: argparse.Namespace) -> Plan:
    """Return the match that a session is; starts and writes nothing.

    Args:
        study: whose session it is.
        found: the words of the command line.

    Raises:
        ConfigError: a value or a port cannot be used.
        SnapshotError: a player of the protocol is not there or does not fit.
        ModuleNotFoundError: an optional library is missing.
    """
    if importlib.util.find_spec("websockets") is None:  # of the pages
        raise ModuleNotFoundError("No module named 'websockets'", name="websockets")
    site: Path | None = found.site
    words = [*(() if site is not None else LAPTOP), *found.overrides]
    cfg = load_section(site, "study", StudyConfig, words)
    port = _port(cfg.port, found.port)
    seats = seats_of(study.protocol, site, words)
    folder = study.session_folder(found.participant)
    settings: dict[str, object] = {
        "study.folder": str(study.folder.resolve()),
        "study.participant": found.participant,
        "study.players": [[name, seat.player] for name, seat in seats.items()],
        "study.port": port,
        "page.is_led": True,
        "recorder.heart_between_bouts": False,  # nobody has consented yet; hr.tsv has what follows
    }
    argv = [str(site)] if site is not None else []
    argv += ["--protagonist", STATIC, "--out", str(folder)]
    argv += ["--antagonist", found.antagonist] if found.antagonist else []
    argv += _set(found.overrides)
    plan = play_plan_of(parse_play([*argv, *_set(_words(settings))]))
    if plan.antagonist.reference != PERSON:
        settings["study.antagonist"] = plan.antagonist.reference
    settings["study.needs_recorder"] = plan.play.record
    heart = load_section(site, "heart_rate", HeartRateConfig, words)
    settings["study.has_heart_rate"] = heart.source != "none"
    plan = play_plan_of(parse_play([*argv, *_set(_words(settings))]))
    run = f"{study.protocol.name}-{found.participant}-{folder.name}"
    return msgspec.structs.replace(plan, run=run_id_of(Path(run)))


def spoken(progress: Progress) -> str:
    """Return how far a session had come, in words."""
    where = f" in {progress.begun}" if progress.begun else ""
    return f"{'aborted' if progress.state == 'aborted' else 'left'}{where}"


def ending_text(plan: Plan, study: Study, progress: Progress, participant: str) -> str:
    """Return the lines that a session ends with."""
    steps = study.steps_of(participant)
    done = sum(step.id in progress.done for step in steps)
    lines = [f"{participant}: {progress.state}, {done} of {len(steps)} steps done"]
    for step in steps:
        for attempt in progress.games.get(step.id, ()):
            score = attempt.end.score if attempt.end is not None else None
            points = f"{score:+g}" if score is not None else "-"
            why = f"  {printable(attempt.reason)}" if attempt.reason else ""
            lines.append(f"  {attempt.start.bout:<16}{attempt.outcome:<10}{points:>8}{why}")
    lines.append(f"data       {plan.folder}")
    if progress.state in ("new", "going", "aborted"):
        lines.append("to go on   say the same command again")
    return "\n".join(lines)


def _set(words: Sequence[str]) -> list[str]:
    return [part for word in words for part in ("--set", word)]


def _words(settings: Mapping[str, object]) -> list[str]:
    return [override(key, value) for key, value in settings.items()]


def _port(of_site: int, asked: int | None) -> int:
    """Return a port that is free.

    Raises:
        ConfigError: the one that was asked for is in use.
    """
    wanted = of_site if asked is None else asked
    port = free_port(wanted) if wanted else 0
    is_chosen = asked is not None or of_site != StudyConfig().port
    if port != wanted and is_chosen:
        raise ConfigError(
            f"study.port: {wanted} is in use by another program; stop it, name another port, or "
            "leave it out to get a free one"
        )
    return port


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
