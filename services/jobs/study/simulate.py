"""`riposte study simulate`: a whole study with simulated people, and its analysis."""

import argparse
import os
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Final

import msgspec
import numpy as np

from services.jobs.study.rehearsal_crew import Crew, Standing
from services.jobs.study.rehearsal_plan import (
    RehearsalPlan,
    make_plan,
    write_plan,
)
from shared.clock import SystemClock
from shared.errors import ConfigError, StudyError
from shared.runtime.build import commit
from shared.runtime.files import atomic_write
from shared.runtime.service import version
from shared.study.analysis.chapter import Chapter
from shared.study.analysis.games import Games, games_of
from shared.study.analysis.power import Planned
from shared.study.analysis.power import plan as plan_power
from shared.study.analysis.results import (
    Analysis,
    ChapterResults,
    analyse_folder,
    write_analysis,
)
from shared.study.drawing import draw_orders
from shared.study.folder import PROTOCOL, Study, make_study, note_change, open_study
from shared.study.people.chapter import PAPER_EFFECT, TRIED, rehearsal_chapter
from shared.study.people.population import draw
from shared.study.protocol_file import SHIPPED, shipped_protocol
from shared.study.recorded import write_participants
from shared.study.tables import load_study

MAX_PEOPLE: Final = 999
MAX_SEED: Final = 2**31 - 1
MAX_PROCESSES: Final = 64
LINE_SECONDS: Final = 20.0
"""From one plain line of progress to the next."""
ANALYSIS: Final = "analysis"
SUMMARY: Final = "rehearsal.json"
"""In the study's folder."""
POWER_DRAWS: Final = 2000


def main(argv: Sequence[str]) -> int:
    """Run ``riposte study simulate``; return the exit code."""
    found = _parse(argv)
    began = time.monotonic()
    folder = found.out or Path("runs") / f"rehearsal-{Path(found.protocol).stem}-{found.seed}"
    study, plan = _prepare(found, folder)
    people = len(study.assignments)
    crew = Crew(study, people, found.processes)
    show = _Screen(sys.stderr.isatty())
    crew.run(show)
    played = time.monotonic() - began
    study = open_study(folder)
    write_participants(study)
    analysis = analyse(study, plan, people)
    written = write_analysis(analysis, folder / ANALYSIS)
    chapter = analysis.results.chapter("rehearsal")
    summary = {
        "study": study.protocol.name, "people": people, "seed": plan.seed, "folder": str(folder),
        "report": str(written[0]), "commit": commit(),
        "wall_s": round(played, 1),
        "cpu_s": round(crew.cpu_seconds, 1),
        "analysis_s": round(time.monotonic() - began - played, 1),
        "says": chapter.says, "tables": {table.name: table.rows for table in chapter.tables},
    }  # fmt: skip
    data = msgspec.json.encode(summary)
    atomic_write(folder / SUMMARY, msgspec.json.format(data, indent=1))
    if found.json:
        print(data.decode())
        return 0
    print("\n\n".join(chapter.says))
    print(f"\n{people} people in {played:.0f} s ({crew.cpu_seconds:.0f} s of processor time)")
    print(f"report: {written[0]}")
    return 0


def analyse(study: Study, plan: RehearsalPlan, people: int) -> Analysis:
    """Return the study's analysis, with the chapter of a rehearsal before the others.

    Args:
        study: that was played.
        plan: of the rehearsal.
        people: who took part.

    Raises:
        RiposteError: the study's tables cannot be read.
    """
    tables = load_study(study.folder, unblind=True)
    found = analyse_folder(study.folder, tables)
    games = games_of(tables)
    heuristics = [c.name for c in study.protocol.condition if c.player.startswith("scripted:")]
    faster = heuristics[0] if len(heuristics) == 1 and len(games.conditions) == 2 else ""
    chapter = rehearsal_chapter(
        games, plan.people, tuple(draw(plan.people, k, plan.seed) for k in range(1, people + 1)),
        _power(games, faster, plan.seed), faster,
        plan.game.point * study.protocol.game.seconds / plan.sim.control_timestep,
    )  # fmt: skip
    return _with(found, chapter)


def _power(games: Games, faster: str, seed: int) -> Planned | None:
    if not faster:
        return None
    whole = np.isfinite(games.by_condition).all(axis=(1, 2))
    index = games.conditions.index(faster)
    first, second = games.by_condition[whole, index], games.by_condition[whole, 1 - index]
    try:
        return plan_power(
            games.numbers, first, second, PAPER_EFFECT, TRIED, POWER_DRAWS,
            np.random.default_rng([seed, 4]),
        )  # fmt: skip
    except StudyError:  # too few people: the rest of the report stands without it
        return None


def _with(found: Analysis, chapter: Chapter) -> Analysis:
    own = ChapterResults(
        key=chapter.key, title=chapter.title, says=chapter.says, headlines=chapter.headlines,
        findings=chapter.findings, tables=chapter.tables,
    )  # fmt: skip
    results = msgspec.structs.replace(found.results, chapters=(own, *found.results.chapters))
    return Analysis(results, (chapter, *found.chapters))


def _prepare(found: argparse.Namespace, folder: Path) -> tuple[Study, RehearsalPlan]:
    """Make the study's folder, or take up one that is there."""
    source = shipped_protocol(found.protocol) if found.protocol in SHIPPED else Path(found.protocol)
    if not source.is_file():
        raise ConfigError(
            f"{found.protocol!r} is no protocol: say {', '.join(SHIPPED)}, or name a file"
        )
    data, clock = source.read_bytes(), SystemClock()
    if (folder / PROTOCOL).exists():
        if (folder / PROTOCOL).read_bytes() != data:
            raise ConfigError(f"{folder} holds another protocol than {source}: name a new --out")
        study = open_study(folder)
    else:
        study = make_study(folder, data, str(source), version(), clock)
        note_change(folder, "a rehearsal: simulated people, nobody takes part", clock)
    people = found.people or study.protocol.people
    plan = make_plan(
        study.protocol, found.site, tuple(found.overrides), found.seed,
        is_archived=not found.no_archive,
    )  # fmt: skip
    write_plan(folder, plan)
    if len(study.assignments) < people:
        study = draw_orders(folder, people, found.seed, clock)
    if len(study.assignments) > people:
        raise ConfigError(
            f"{folder} was begun with {len(study.assignments)} people, --people is {people}: "
            "people can be added, not left out"
        )
    return study, plan


def _parse(argv: Sequence[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="riposte study simulate", description=__doc__)
    parser.add_argument(
        "protocol", metavar="PROTOCOL", help=f"{', '.join(SHIPPED)}, or a protocol's file (TOML)"
    )
    parser.add_argument("--people", type=int, metavar="N", help="how many (the protocol's)")
    parser.add_argument("--seed", type=int, default=1, metavar="S", help="of people and orders")
    parser.add_argument(
        "--out", type=Path, metavar="DIR",
        help="the study's folder; said again, what is missing is played (runs/rehearsal-...)",
    )  # fmt: skip
    parser.add_argument(
        "--processes", type=int, default=min(2, os.cpu_count() or 1), metavar="P",
        help="people at a time",
    )  # fmt: skip
    parser.add_argument(
        "--site", type=Path, metavar="FILE", help="site file (TOML); none: the real robot's twin"
    )
    parser.add_argument(
        "--set", action="append", default=[], dest="overrides", metavar="SECTION.KEY=VALUE",
        help="over the site file; [people] as well: people.specific=0",
    )  # fmt: skip
    parser.add_argument(
        "--no-archive", action="store_true", help="leave out the recordings of the bouts"
    )
    parser.add_argument("--json", action="store_true", help="end with one JSON object")
    found = parser.parse_args(argv)
    for name, value, low, high in (
        ("people", found.people, 1, MAX_PEOPLE), ("seed", found.seed, 0, MAX_SEED),
        ("processes", found.processes, 1, MAX_PROCESSES),
    ):  # fmt: skip
        if value is not None and not low <= value <= high:
            raise ConfigError(f"--{name} is {value}; allowed are {low} to {high}")
    return found


class _Screen:
    """Says how far it is: one line that is written over, or a plain line now and then."""

    def __init__(self, is_terminal: bool) -> None:
        self._is_terminal = is_terminal
        self._said_at = -LINE_SECONDS

    def __call__(self, standing: Standing) -> None:
        is_due = standing.seconds - self._said_at >= LINE_SECONDS
        is_over = standing.done == standing.people
        if not self._is_terminal and not is_due and not is_over:
            return
        self._said_at = standing.seconds
        left = standing.seconds_left
        words = (
            f"{100.0 * standing.share:3.0f} %  {standing.done} of {standing.people} people  "
            f"{_time(standing.seconds)} passed"
            + ("" if left is None else f", {_time(left)} left")
            + (f"  ({', '.join(standing.playing)})" if standing.playing else "")
        )
        end = "\n" if not self._is_terminal or is_over else ""
        start = "\r\x1b[K" if self._is_terminal else ""
        sys.stderr.write(f"{start}{words}{end}")
        sys.stderr.flush()


def _time(seconds: float) -> str:
    return f"{int(seconds) // 60}:{int(seconds) % 60:02d}"
