"""The part of a rehearsal's report that says what it is, and answers what it was played for."""

from typing import Final

import numpy as np

from shared.study.analysis.chapter import (
    Cell,
    Chapter,
    Table,
    estimate_words,
    number_text,
    p_words,
    percent_text,
    verdict,
)
from shared.study.analysis.finding import Finding
from shared.study.analysis.games import Games
from shared.study.analysis.power import Planned
from shared.study.analysis.regression import compare_slopes, mean_slope
from shared.study.analysis.switch import switch_effect
from shared.study.people.population import Population, Traits

NOT_PEOPLE: Final = (
    "Nobody took part: simulated people are not people. How they move, learn and answer was put "
    "into them (docs/rehearsal.md); this shows whether the study's software and its statistics "
    "work, and what they could find, and nothing about persons."
)
PILOT: Final = (
    "The scatter is that of the people who played. That of simulated people is not that of people: "
    "plan with a pilot."
)
TRIED: Final = (
    *range(4, 21), *range(22, 41, 2), 45, 50, 60, 70, 80, 100, 120, 150, 200, 300, 500, 1000,
)  # fmt: skip
"""Numbers of people that the power is told for."""
CEILING: Final = 0.9
"""A game with this share of the points of an untouched bat leaves little to learn."""
PAPER_EFFECT: Final = 30.0 - 15.7
"""Difference of the paper's slopes, baseline less trained policy (points a game)."""


def slope_question(games: Games, names: tuple[str, str]) -> Finding:
    """Return whether people learn faster against the first of two conditions.

    Args:
        games: of the study.
        names: the condition expected to be learned faster, then the other.
    """
    one, two = (games.by_condition[:, games.conditions.index(name)] for name in names)
    return compare_slopes(games.numbers, one, two, f"slope: {names[0]} - {names[1]}")


def rehearsal_chapter(
    games: Games, population: Population, people: tuple[Traits, ...], planned: Planned | None,
    faster: str, most_points: float,
) -> Chapter:  # fmt: skip
    """Return the chapter.

    Args:
        games: of the rehearsal, conditions by name.
        population: that the people were drawn from.
        people: who took part.
        planned: how many people the paper's effect needs; None where there are not two conditions.
        faster: the condition that the paper's people learned faster; empty where there is none.
        most_points: of an untouched bat in the target for a whole game.
    """
    says = [NOT_PEOPLE]
    findings: list[Finding] = []
    names = games.conditions
    if len(names) == 2 and faster in names:
        other = next(name for name in names if name != faster)
        asked = slope_question(games, (faster, other))
        findings.append(asked)
        if asked.estimate is not None:
            says.append(
                f"Do simulated learners improve more slowly against {other} than against {faster}? "
                f"Their slopes differ by {estimate_words(asked.estimate)} points a game "
                f"({p_words(asked)}; the paper's people: 30.0 - 15.7 = {PAPER_EFFECT:.1f}): "
                f"{_slower(asked)}."
            )
    rows = _rows(games, most_points)
    at_ceiling = [str(row[0]) for row in rows if isinstance(row[5], float) and row[5] > 0.5]
    if at_ceiling:
        says.append(
            f"Most games against {' and '.join(at_ceiling)} reach {percent_text(CEILING)} of what "
            "an untouched bat would score: there little is left to be learned, whoever learns."
        )
    switch = switch_effect(games)
    findings.append(switch)
    if switch.estimate is not None:
        says.append(
            f"Does a switch of style interrupt their learning? At a switch the score changes by "
            f"{estimate_words(switch.estimate)} points more than from game to game "
            f"({p_words(switch)}): "
            + verdict(switch, "a change", "no significant change")
            + f". What is put in: {percent_text(population.specific)} of what is learned about "
            "reading an opponent is lost with a new one, an assumption and no result."
        )
    if planned is not None:
        says.append(f"{power_words(planned, faster)} {PILOT}")
    table = Table(
        name="rehearsal",
        title="Simulated people and their scores",
        columns=("condition", "mean score", "slope (points a game)", "95 % low", "95 % high",
                 "games near the ceiling"),
        rows=tuple(rows),
        note="Slope: mean of people's own; its interval is that of a one-sample t-test.",
    )  # fmt: skip
    tables = (table, _people_table(people))
    if planned is not None:
        tables = (*tables, _power_table(planned))
    return Chapter(
        key="rehearsal", title="A rehearsal", says=tuple(says), headlines=2,
        findings=tuple(findings), tables=tables,
    )  # fmt: skip


def _slower(asked: Finding) -> str:
    if asked.estimate is None or not asked.is_significant:
        return "not significantly, and the interval says what can be excluded"
    return "yes" if asked.estimate.value > 0.0 else "no, faster"


def _rows(games: Games, most_points: float) -> list[tuple[Cell, ...]]:
    rows: list[tuple[Cell, ...]] = []
    for index, name in enumerate(games.conditions):
        cube = games.by_condition[:, index]
        there = cube[np.isfinite(cube)]
        found = mean_slope(games.numbers, cube, name)
        estimate = found.estimate
        low = estimate.low if estimate is not None else None
        high = estimate.high if estimate is not None else None
        rows.append((
            name,
            round(float(there.mean()), 1) if len(there) else None,
            None if estimate is None else round(estimate.value, 1),
            None if low is None else round(low, 1),
            None if high is None else round(high, 1),
            round(float(np.mean(there >= CEILING * most_points)), 3) if len(there) else None,
        ))  # fmt: skip
    return rows


def _people_table(people: tuple[Traits, ...]) -> Table:
    rows: list[tuple[Cell, ...]] = [
        (each.number, each.law, round(each.rate, 3), round(each.start, 2),
         round(each.asymptote, 2), each.specific)
        for each in people
    ]  # fmt: skip
    return Table(
        name="simulated_people", title="What was put into them",
        columns=("person", "law of practice", "rate", "share at first", "share in the end",
                 "specific to the opponent"),
        rows=tuple(rows), is_folded=True,
    )  # fmt: skip


def power_words(planned: Planned, faster: str) -> str:
    """Return in a sentence how many people are needed.

    Args:
        planned: what was found.
        faster: the condition that is to be learned faster; empty where none is named.
    """
    has = f"{planned.people} people, a game's of {number_text(planned.residual_sd)} points"
    most = planned.curve[-1].people
    if planned.needed is None:
        needed = f"more than {most} people are needed"
    else:
        low = planned.needed_low if planned.needed_low is not None else f"over {most}"
        high = planned.needed_high if planned.needed_high is not None else f"over {most}"
        needed = f"{planned.needed} people are needed (95 %: {low} to {high})"
    about = f" (steeper against {faster})" if faster else ""
    return (
        f"For a difference of {planned.effect:.1f} points a game{about} to be found in 8 of 10 "
        f"studies, {needed}; by the scatter of {has}."
    )


def _power_table(planned: Planned) -> Table:
    rows: list[tuple[Cell, ...]] = [
        (each.people, round(each.power.value, 3),
         None if each.power.low is None else round(each.power.low, 3),
         None if each.power.high is None else round(each.power.high, 3))
        for each in planned.curve
    ]  # fmt: skip
    return Table(
        name="power", title=f"Power for {planned.effect:.1f} points a game",
        columns=("people", "power", "95 % low", "95 % high"), rows=tuple(rows), is_folded=True,
        note="Simulated studies with the scatter of this one; the interval is that of their "
        "number.",
    )  # fmt: skip
