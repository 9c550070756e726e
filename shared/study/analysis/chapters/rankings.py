"""Rankings: what people enjoyed and found difficult, and how both go together."""

import itertools

import numpy as np
from numpy.typing import NDArray

from shared.study.analysis.chapter import (
    Cell,
    Chapter,
    Picture,
    Table,
    interval_text,
    number_text,
    p_words,
    percent_text,
    significant,
    verdict,
)
from shared.study.analysis.correlation import pearson, within_people
from shared.study.analysis.finding import Finding
from shared.study.analysis.games import Games, mean_there
from shared.study.analysis.paired import pairwise
from shared.study.analysis.questionnaires import ranks_of
from shared.study.analysis.repeated import repeated_anova
from shared.study.tables import Tables
from shared.telemetry.study_figures import RankPanel, rank_panels
from shared.telemetry.wording import listing

Floats = NDArray[np.float64]


def rankings_chapter(
    tables: Tables, games: Games, generator: np.random.Generator
) -> Chapter | None:
    """Return what the rankings say, None where nobody ranked anything."""
    questions = [item for each in tables.protocol.instrument for item in each.item
                 if item.scale == "ranking"]  # fmt: skip
    findings: list[Finding] = []
    says: list[str] = []
    tables_made: list[Table] = []
    panels: list[RankPanel] = []
    cubes: dict[str, Floats] = {}
    sections = games.by_section.shape[1]
    for item in questions:
        by_condition, by_section = _cubes(tables, games, item.id)
        if not np.isfinite(by_section).any():
            continue
        cubes[item.id] = by_section
        numbers = tuple(f"section {k}" for k in range(1, sections + 1))
        for name, names, cube in (("condition", games.conditions, by_condition),
                                  ("section", numbers, by_section)):  # fmt: skip
            tests = _tests(item.id, name, names, cube, len(games.first), generator)
            findings += tests
            says.append(_words(item.id, name, names, cube, tests))
            tables_made.append(_table(item.id, name, names, cube))
            panels.append(_panel(item.id, name, names, cube))
    if not cubes:
        return None
    says.sort(key=lambda sentence: " by section " in sentence)
    for first, second in itertools.combinations(cubes, 2):
        tests = _together(first, second, cubes[first], cubes[second])
        findings += tests
        says.insert(len(cubes), _together_words(first, second, tests))
    ends = "; ".join(f"{item.id}: 1 = {item.ends[0]}" for item in questions if item.ends)
    return Chapter(
        key="rankings", title="Rankings", says=tuple(says), headlines=len(cubes) + 1,
        findings=tuple(findings), tables=tuple(tables_made),
        pictures=(Picture(lambda: rank_panels(panels),
                          f"Mean rank with its standard error ({ends})."),),
    )  # fmt: skip


def _cubes(tables: Tables, games: Games, question: str) -> tuple[Floats, Floats]:
    """Return float64[n, C] and float64[n, S], ranks 1 to k within a person, ties shared."""
    n, sections = len(games.people), games.by_section.shape[1]
    by_condition, by_section = (
        np.full((n, len(games.conditions)), np.nan),
        np.full((n, sections), np.nan),
    )
    for (person, section), (condition, rank) in ranks_of(tables, games.people, question).items():
        k = games.people.index(person)
        if section <= sections and condition in games.conditions:
            by_section[k, section - 1] = rank
            by_condition[k, games.conditions.index(condition)] = rank
    return _shared(by_condition), _shared(by_section)


def _shared(cube: Floats) -> Floats:
    made = np.full(cube.shape, np.nan)
    for k, row in enumerate(cube):
        there = np.isfinite(row)
        values = row[there]
        below = (values[:, None] > values[None, :]).sum(axis=1)
        equal = (values[:, None] == values[None, :]).sum(axis=1)
        made[k, there] = below + (equal + 1) / 2.0
    return made


def _tests(
    question: str, kind: str, names: tuple[str, ...], cube: Floats, first: int,
    generator: np.random.Generator,
) -> list[Finding]:  # fmt: skip
    found: list[Finding] = []
    if len(names) > 2:
        found.append(repeated_anova(cube, f"{question} over {len(names)} {kind}s", generator))
    if first and len(names) - first > 1:
        rest = cube[:, first:]
        words = f"{question} over {listing(names[first:])}"
        found.append(repeated_anova(rest, words, generator))
    return [*found, *pairwise(cube, names, question, "mean difference of ranks")]


def _words(
    question: str, kind: str, names: tuple[str, ...], cube: Floats, tests: list[Finding]
) -> str:
    means = ", ".join(f"{name.removeprefix('section ')} {number_text(mean_there(column), 3)}"
                      for name, column in zip(names, cube.T, strict=True)
                      if np.isfinite(column).any())  # fmt: skip
    parts: list[str] = []
    for test in tests:
        if test.test == "repeated-measures ANOVA" and test.p is not None:
            what = test.question.removeprefix(f"{question} over ")
            differ = verdict(test, "differ", "do not differ significantly")
            parts.append(f"{what} {differ} ({p_words(test)})")
    pairs = significant([test for test in tests if test.test == "paired t-test"])
    if pairs:
        words = [f"{test.question.removeprefix(f'{question}: ')} ({p_words(test)})"
                 for test in pairs]  # fmt: skip
        parts.append(f"pairs that differ: {listing(words)}")
    head = f"{question.capitalize()} by {kind} (mean ranks: {means})"
    return f"{head}: {'; '.join(parts) or 'no test was done'}."


def _table(question: str, kind: str, names: tuple[str, ...], cube: Floats) -> Table:
    rows: list[tuple[Cell, ...]] = []
    k = cube.shape[1]
    for name, column in zip(names, cube.T, strict=True):
        there = column[np.isfinite(column)]
        if not len(there):
            rows.append((name, 0, None, None, None, None))
            continue
        top, bottom = ((there == rank).sum() / len(there) for rank in (k, 1))
        error = float(there.std(ddof=1) / np.sqrt(len(there))) if len(there) > 1 else None
        rows.append((
            name, len(there), round(float(there.mean()), 2),
            None if error is None else round(error, 2), percent_text(float(top)),
            percent_text(float(bottom)),
        ))  # fmt: skip
    return Table(
        name=f"rank_{question}_by_{kind}",
        title=f"Ranks of {question} by {kind}",
        columns=(kind, "people", "mean rank", "standard error", "most, alone", "least, alone"),
        rows=tuple(rows),
        note="From the ranking after the last section that a person answered; 1 is least, "
        "equal ones share their ranks.",
        is_folded=True,
    )


def _panel(question: str, kind: str, names: tuple[str, ...], cube: Floats) -> RankPanel:
    columns = [column[np.isfinite(column)] for column in cube.T]
    errors = [float(c.std(ddof=1)) / len(c) ** 0.5 if len(c) > 1 else 0.0 for c in columns]
    means = [float(c.mean()) if len(c) else 0.0 for c in columns]
    short = tuple(name.removeprefix("section ") for name in names)
    return RankPanel(f"{question} by {kind}", short, means, errors, cube.shape[1])


def _together(first: str, second: str, one: Floats, two: Floats) -> list[Finding]:
    question = f"ranks of {first} and {second}"
    return [
        pearson(one.ravel(), two.ravel(), question, unit="sections"),
        within_people(one, two, question),
    ]


def _together_words(first: str, second: str, tests: list[Finding]) -> str:
    everybody, within = tests
    if everybody.effect is None:
        return f"{first.capitalize()} and {second} were not correlated: {everybody.note}."
    text = (
        f"{first.capitalize()} and {second} correlate with r = "
        f"{number_text(everybody.effect.value, 2)} over sections of all people"
    )
    if within.effect is not None:
        text += (f", and with {number_text(within.effect.value, 2)} (95 %: "
                 f"{interval_text(within.effect, 2)}; {p_words(within)}) "
                 "within people")  # fmt: skip
    return f"{text}."
