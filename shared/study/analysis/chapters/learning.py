"""Learning: whether scores rise with games, how steeply, and whether conditions differ in that."""

import itertools

import numpy as np
from numpy.typing import NDArray

from shared.study.analysis.chapter import (
    Cell,
    Chapter,
    Picture,
    Table,
    estimate_words,
    interval_text,
    number_text,
    p_text,
    p_words,
    significant,
    verdict,
)
from shared.study.analysis.finding import Finding
from shared.study.analysis.games import Games
from shared.study.analysis.mixed import mixed_slopes
from shared.study.analysis.paired import holm
from shared.study.analysis.regression import compare_slopes, mean_slope, person_slopes, pooled
from shared.study.analysis.repeated import repeated_anova
from shared.study.analysis.switch import switch_effect
from shared.telemetry.study_figures import LinePanel, learning_panels
from shared.telemetry.wording import listing

Floats = NDArray[np.float64]


def learning_chapter(games: Games, generator: np.random.Generator) -> Chapter | None:
    """Return how scores change with games; None before the first game."""
    if not np.isfinite(games.by_section).any() or games.by_section.shape[2] < 2:
        return None
    names, x = games.conditions, games.numbers
    cubes = [games.by_condition[:, k] for k in range(len(names))]
    rises = [
        repeated_anova(_played(cube), f"score over the games against {name}", generator)
        for name, cube in zip(names, cubes, strict=True)
    ]
    lines = [pooled(x, cube, f"score on game number against {name}")
             for name, cube in zip(names, cubes, strict=True)]  # fmt: skip
    means = holm([mean_slope(x, cube, f"people's own slopes against {name}")
                  for name, cube in zip(names, cubes, strict=True)])  # fmt: skip
    compared = [
        compare_slopes(x, cubes[a], cubes[b], f"slope: {names[a]} - {names[b]}")
        for a, b in itertools.combinations(range(len(names)), 2)
    ]
    compared = list(holm(compared))
    mixed: list[Finding] = []
    if len(names) == 2:
        mixed.append(mixed_slopes(x, cubes[0], cubes[1], f"slope: {names[0]} - {names[1]}"))
    switch = switch_effect(games)
    says = [
        *_line_words(lines, names),
        *_compared_words(compared, mixed),
        _rise_words(holm(rises), names),
        *_switch_words(switch),
    ]
    pictures: list[Picture] = []
    if panels := _panels(games, lines):
        words = (
            "Every game of everybody (dots), each person's own line (thin), and the line through "
            "all games with its 95 % band."
        )
        pictures.append(Picture(lambda: learning_panels(panels), words))
    return Chapter(
        key="learning",
        title="Learning",
        says=tuple(says),
        headlines=3,
        findings=(*lines, *means, *compared, *mixed, *holm(rises), switch),
        tables=(_lines_table(lines, names), _slopes_table(games)),
        pictures=tuple(pictures),
    )


def _played(cube: Floats) -> Floats:
    return cube[:, np.isfinite(cube).any(axis=0)]


def _switch_words(found: Finding) -> list[str]:
    if found.p is None or found.estimate is None:
        return []
    words = verdict(
        found, "a switch of the robot interrupts people",
        "no significant interruption by a switch of the robot",
    )  # fmt: skip
    if found.is_significant and found.estimate.value > 0.0:
        words = "a switch of the robot does not set people back"
    return [
        f"Where the robot switches, the score changes by {estimate_words(found.estimate)} points "
        f"more than from game to game, the robots' difficulty taken out ({p_words(found)}): "
        f"{words}."
    ]


def _line_words(lines: list[Finding], names: tuple[str, ...]) -> list[str]:
    parts = [
        f"against {name} {number_text(line.estimate.value)} points a game "
        f"(95 %: {interval_text(line.estimate)}; r = {number_text(line.effect.value, 2)}, "
        f"{p_words(line)})"
        for name, line in zip(names, lines, strict=True)
        if line.estimate is not None and line.effect is not None
    ]
    if not parts:
        return []
    return [f"A line through all games, taken as independent, rises {listing(parts)}."]


def _compared_words(compared: list[Finding], mixed: list[Finding]) -> list[str]:
    done = [finding for finding in compared if finding.p is not None]
    if not done:
        return []
    if len(compared) > 1:
        found = significant(compared)
        if not found:
            return ["People's slopes do not differ significantly between any two conditions."]
        words = [f"{finding.question.removeprefix('slope: ')} "
                 f"{estimate_words(finding.estimate)} ({p_words(finding)})"
                 for finding in found if finding.estimate is not None]  # fmt: skip
        return [f"People's own slopes differ: {listing(words)}."]
    finding = done[0]
    assert finding.estimate is not None
    text = (
        f"Within people, the slopes differ by {estimate_words(finding.estimate)} points a game "
        f"({finding.question.removeprefix('slope: ')}; {p_words(finding)}): "
        f"{verdict(finding, 'significantly', 'not significantly')}."
    )
    for model in mixed:
        if model.p is None:
            text += f" Mixed model {model.note}."
        else:
            same = model.is_significant == finding.is_significant
            text += f" The mixed model {'agrees' if same else 'does not agree'} ({p_words(model)})."
    return [text]


def _rise_words(rises: tuple[Finding, ...], names: tuple[str, ...]) -> str:
    found = [name for name, rise in zip(names, rises, strict=True) if rise.is_significant]
    tested = [rise for rise in rises if rise.p is not None]
    if not tested:
        return "Games of a condition were not compared: too few people have all of them."
    values = ", ".join(
        f"{name} {p_text(rise.p)}" for name, rise in zip(names, rises, strict=True)
        if rise.p is not None
    )  # fmt: skip
    if not found:
        return f"In no condition do scores differ significantly between its games (p: {values})."
    return f"Scores differ between the games against {listing(found)} (p: {values})."


def _lines_table(lines: list[Finding], names: tuple[str, ...]) -> Table:
    rows: list[tuple[Cell, ...]] = []
    for name, line in zip(names, lines, strict=True):
        if line.estimate is None or line.effect is None:
            rows.append((name, line.n, None, "", None, None, None))
            continue
        clustered = next((b for b in line.beside if b.p is not None and b.unit == "people"), None)
        rows.append((
            name, line.n, round(line.estimate.value, 1), interval_text(line.estimate),
            round(line.effect.value, 2), line.p, None if clustered is None else clustered.p,
        ))  # fmt: skip
    return Table(
        name="regression",
        title="Regression of score on game number, all games",
        columns=("condition", "games", "slope", "95 %", "r", "p", "p, clustered by person"),
        rows=tuple(rows),
        note="Slope in points a game. The paper's p takes games of one person for games of "
        "different people; the last column does not.",
    )


def _slopes_table(games: Games) -> Table:
    slopes = [person_slopes(games.numbers, games.by_condition[:, k])
              for k in range(len(games.conditions))]  # fmt: skip
    rows: list[tuple[Cell, ...]] = [
        (person, *(None if np.isnan(s[k]) else round(float(s[k]), 2) for s in slopes))
        for k, person in enumerate(games.people)
    ]
    return Table(
        name="slopes", title="Slope of each person (points a game)",
        columns=("participant", *games.conditions), rows=tuple(rows), is_folded=True,
    )  # fmt: skip


def _panels(games: Games, lines: list[Finding]) -> list[LinePanel]:
    return [
        LinePanel(title=name, games=games.numbers.tolist(), scores=games.by_condition[:, k])
        for k, (name, line) in enumerate(zip(games.conditions, lines, strict=True))
        if line.estimate is not None
    ]
