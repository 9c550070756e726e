"""Everything that a study says: its chapters in order, how they were made, and files of both."""

import csv
import dataclasses
import io
from collections.abc import Sequence
from pathlib import Path

import msgspec
import numpy as np

from shared.errors import RiposteError
from shared.runtime.files import atomic_write
from shared.study.analysis.chapter import Chapter, Table
from shared.study.analysis.chapters.acceptance import acceptance_chapter
from shared.study.analysis.chapters.answers import answers_chapter
from shared.study.analysis.chapters.heart_rate import heart_rate_chapter
from shared.study.analysis.chapters.learning import learning_chapter
from shared.study.analysis.chapters.people import people_chapter
from shared.study.analysis.chapters.rankings import rankings_chapter
from shared.study.analysis.chapters.scores import scores_chapter
from shared.study.analysis.chapters.strategy import strategy_chapter
from shared.study.analysis.finding import Finding
from shared.study.analysis.games import games_of
from shared.study.analysis.methods import Methods, methods_of
from shared.study.analysis.moves import Moves, moves_of
from shared.study.analysis.page import report_page
from shared.study.tables import Tables

SCHEMA = 1
"""Of results.json; goes up when a field changes its meaning."""
RESULTS, REPORT, TESTS = "results.json", "report.html", "tests.csv"
SEED = 20211108
"""Of the bootstrap and the shuffles: the same study gives the same report."""


class ChapterResults(msgspec.Struct, frozen=True, kw_only=True):
    """A chapter in results.json."""

    key: str
    title: str
    says: tuple[str, ...]
    headlines: int = 1
    """How many of them stand in the summary."""
    findings: tuple[Finding, ...]
    tables: tuple[Table, ...]


class Results(msgspec.Struct, frozen=True, kw_only=True):
    """What results.json holds."""

    schema: int = SCHEMA
    study: str
    title: str
    is_blinded: bool
    people: int
    methods: Methods
    chapters: tuple[ChapterResults, ...]

    def chapter(self, key: str) -> ChapterResults:
        """Return a chapter.

        Raises:
            KeyError: the study has nothing for it.
        """
        for chapter in self.chapters:
            if chapter.key == key:
                return chapter
        raise KeyError(key)


@dataclasses.dataclass(frozen=True)
class Analysis:
    """The results with the drawings that go with them."""

    results: Results
    chapters: tuple[Chapter, ...]


def analyse(tables: Tables, moves: Moves, *, seed: int = SEED) -> Analysis:
    """Return everything that the tables of a study say.

    Args:
        tables: of the study.
        moves: how people moved in the archived games.
        seed: of the bootstrap and the shuffles.

    Raises:
        RiposteError: nobody has taken part yet.
    """
    games = games_of(tables)
    if not games.people:
        raise RiposteError("nobody has taken part in this study yet: there is nothing to analyse")
    generator = np.random.default_rng(seed)
    made = (
        people_chapter(tables, games),
        scores_chapter(games, generator),
        learning_chapter(games, generator),
        acceptance_chapter(tables, games, generator),
        heart_rate_chapter(tables, games, generator),
        strategy_chapter(games, moves, generator),
        rankings_chapter(tables, games, generator),
        answers_chapter(tables, games),
    )
    chapters = tuple(chapter for chapter in made if chapter is not None)
    results = Results(
        study=tables.protocol.name,
        title=tables.protocol.title,
        is_blinded=tables.is_blinded,
        people=len(games.people),
        methods=methods_of(tables, seed),
        chapters=tuple(
            ChapterResults(key=c.key, title=c.title, says=c.says, headlines=c.headlines,
                           findings=c.findings, tables=c.tables)
            for c in chapters
        ),
    )  # fmt: skip
    return Analysis(results, chapters)


def analyse_folder(folder: Path, tables: Tables, *, seed: int = SEED) -> Analysis:
    """Return everything that a study folder says, its archived games included.

    Args:
        folder: the study's.
        tables: read from it.
        seed: of the bootstrap and the shuffles.

    Raises:
        RiposteError: nobody has taken part yet.
    """
    return analyse(tables, moves_of(folder, games_of(tables)), seed=seed)


def write_analysis(analysis: Analysis, out: Path) -> list[Path]:
    """Write the report, the results and a CSV file for each table; return what was written.

    Raises:
        RiposteError: the folder cannot be written, or there is no space.
    """
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise RiposteError(f"cannot make {out}: {error.strerror or error}") from error
    files: dict[str, bytes] = {
        REPORT: report_page(analysis.results.title, analysis.results.is_blinded,
                            analysis.results.methods, analysis.chapters).encode(),
        RESULTS: msgspec.json.format(msgspec.json.encode(analysis.results), indent=1),
        TESTS: tests_csv(analysis.chapters),
    }  # fmt: skip
    for chapter in analysis.chapters:
        for table in chapter.tables:
            files[f"{table.name}.csv"] = table_csv(table)
    for name, data in files.items():
        atomic_write(out / name, data)
    return [out / name for name in files]


def table_csv(table: Table) -> bytes:
    """Return a table as CSV, as it is in the report."""
    return _csv(table.columns, table.rows)


def tests_csv(chapters: Sequence[Chapter]) -> bytes:
    """Return every test as a line of CSV; those beside another follow it."""
    columns = (
        "chapter", "question", "test", "role", "n", "unit", "symbol", "statistic", "df", "p",
        "p_adjusted", "family", "estimate", "value", "low", "high", "effect", "effect_value",
        "effect_low", "effect_high", "checks", "left_out", "note",
    )  # fmt: skip
    rows: list[Sequence[object]] = []
    for chapter in chapters:
        for finding in chapter.findings:
            rows.append(_test_row(chapter.key, finding, "main"))
            rows += [_test_row(chapter.key, beside, "beside") for beside in finding.beside]
    return _csv(columns, rows)


def _test_row(chapter: str, finding: Finding, role: str) -> list[object]:
    estimates: list[object] = []
    for estimate in (finding.estimate, finding.effect):
        estimates += (
            ["", None, None, None]
            if estimate is None
            else [estimate.name, estimate.value, estimate.low, estimate.high]
        )
    checks = "; ".join(f"{c.assumption}: {c.test} p = {c.p:.4g}" for c in finding.checks)
    return [
        chapter, finding.question, finding.test, role, finding.n, finding.unit, finding.symbol,
        finding.statistic, " ".join(f"{d:g}" for d in finding.df), finding.p, finding.p_adjusted,
        finding.family or None, *estimates, checks, "; ".join(finding.left_out), finding.note,
    ]  # fmt: skip


def _csv(columns: Sequence[str], rows: Sequence[Sequence[object]]) -> bytes:
    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows([["" if cell is None else _safe(cell) for cell in row] for row in rows])
    return buffer.getvalue().encode()


def _safe(cell: object) -> object:
    """Return a cell that no spreadsheet takes for a formula; people's words may begin with =."""
    return f"'{cell}" if isinstance(cell, str) and cell[:1] in "=+@\t\r" and cell else cell
