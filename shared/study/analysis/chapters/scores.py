"""Scores: points made in each condition, and whether conditions or sections differ."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from shared.study.analysis.chapter import (
    Cell,
    Chapter,
    Picture,
    Table,
    estimate_words,
    number_text,
    p_words,
    verdict,
)
from shared.study.analysis.finding import Finding
from shared.study.analysis.games import Games, mean_of, mean_there
from shared.study.analysis.paired import Named, paired, pairwise
from shared.study.analysis.repeated import repeated_anova
from shared.telemetry.study_figures import ScorePanel, score_panels

Floats = NDArray[np.float64]


def scores_chapter(games: Games, generator: np.random.Generator) -> Chapter | None:
    """Return the scores by condition, section and game; None before the first game."""
    if not np.isfinite(games.by_section).any():
        return None
    conditions, says = _by_conditions(games, generator)
    sections = mean_of(games.by_section)
    findings = [*conditions]
    if sections.shape[1] > 1 and not (sections.shape[1] == 2 and len(games.conditions) == 1):
        order = repeated_anova(sections, "mean score over the sections, as played", generator)
        findings.append(order)
        says.append(_section_words(order))
    return Chapter(
        key="scores",
        title="Scores",
        says=tuple(says),
        headlines=2,
        findings=tuple(findings),
        tables=(_table(games), _by_game(games)),
        pictures=(
            Picture(
                lambda: score_panels(_panels(games)),
                "Mean score of each game over people, with its standard error; the dashed line is "
                "the best mean score over the games of a condition that one person reached.",
            ),
        ),
    )


def best_means(games: Games) -> list[tuple[str, float]]:
    """Return by condition who has the best mean score over its games, and the score."""
    found: list[tuple[str, float]] = []
    for column in games.means.T:
        if np.isfinite(column).any():
            k = int(np.nanargmax(column))
            found.append((games.people[k], float(column[k])))
        else:
            found.append(("", float("nan")))
    return found


def _by_conditions(
    games: Games, generator: np.random.Generator
) -> tuple[tuple[Finding, ...], list[str]]:
    names, means = games.conditions, games.means
    words = ", ".join(
        f"{name} {number_text(mean_there(cube), 4)}"
        for name, cube in zip(names, games.by_condition.transpose(1, 0, 2), strict=True)
        if np.isfinite(cube).any()
    )
    says = [f"Mean score by condition: {words}."]
    if len(names) == 2:
        question = f"mean score: {names[0]} - {names[1]}"
        found = paired(means[:, 0], means[:, 1], Named(question))
        if found.p is not None and found.estimate is not None:
            says.append(
                f"A person's mean score against {names[0]}, less that against {names[1]}: "
                f"{estimate_words(found.estimate)} points ({p_words(found)}), "
                f"{verdict(found, 'a significant difference', 'no significant difference')}."
            )
        return (found,), says
    if len(names) < 2:
        return (), says
    overall = repeated_anova(means, f"mean score over {len(names)} conditions", generator)
    says.append(
        f"Conditions {verdict(overall, 'differ', 'do not differ significantly')} in mean score "
        f"({p_words(overall)})."
    )
    return (overall, *pairwise(means, names, "mean score")), says


def _section_words(found: Finding) -> str:
    if found.p is None:
        return f"Sections were not compared: {found.note.removeprefix('not done: ')}."
    words = verdict(found, "differ", "do not differ significantly")
    f = number_text(found.statistic, 3)
    return f"Scores over the sections, in the order played, {words} (F = {f}, {p_words(found)})."


def _table(games: Games) -> Table:
    rows: list[tuple[Cell, ...]] = []
    best = best_means(games)
    for k, name in enumerate(games.conditions):
        cube = games.by_condition[:, k]
        there = cube[np.isfinite(cube)]
        if not len(there):
            rows.append((name, 0, 0, None, None, None, None, None, ""))
            continue
        people = int(np.isfinite(cube).any(axis=1).sum())
        rows.append((
            name, people, len(there), round(float(there.mean()), 1),
            round(float(there.std(ddof=1)), 1) if len(there) > 1 else None,
            round(float(there.max()), 1), round(float(there.min()), 1), round(best[k][1], 1),
            best[k][0],
        ))  # fmt: skip
    return Table(
        name="scores",
        title="Scores by condition",
        columns=("condition", "people", "games", "mean", "SD", "maximum", "minimum",
                 "best mean of a person", "whose"),
        rows=tuple(rows),
        note="Over all games that count; SD is between games.",
    )  # fmt: skip


def _by_game(games: Games) -> Table:
    rows: list[tuple[Cell, ...]] = []
    for panel in _panels(games):
        for game, mean, error, n in zip(
            panel.games, panel.means, panel.errors, panel.counts, strict=True
        ):
            rows.append((panel.title, int(game), n, round(mean, 1), round(error, 1)))
    return Table(
        name="scores_by_game",
        title="Mean score of each game",
        columns=("condition", "game", "people", "mean", "standard error"),
        rows=tuple(rows),
        is_folded=True,
    )


def _panels(games: Games) -> Sequence[ScorePanel]:
    panels: list[ScorePanel] = []
    for k, (name, (_, best)) in enumerate(zip(games.conditions, best_means(games), strict=True)):
        cube = games.by_condition[:, k]
        there = np.isfinite(cube)
        counts = there.sum(axis=0)
        played = np.flatnonzero(counts)
        columns = [cube[there[:, game], game] for game in played]
        panels.append(
            ScorePanel(
                title=name,
                games=[float(games.numbers[game]) for game in played],
                means=[float(column.mean()) for column in columns],
                errors=[
                    float(column.std(ddof=1) / np.sqrt(len(column))) if len(column) > 1 else 0.0
                    for column in columns
                ],
                counts=[len(column) for column in columns],
                best=best,
            )
        )
    return panels
