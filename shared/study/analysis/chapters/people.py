"""Who took part, and what is there of each."""

import math

import numpy as np

from shared.study.analysis.chapter import Cell, Chapter, Table, number_text
from shared.study.analysis.games import Games, each
from shared.study.analysis.questionnaires import choice_items, chosen
from shared.study.tables import Tables


def people_chapter(tables: Tables, games: Games) -> Chapter:
    """Return who took part and which data there are."""
    planned, there = tables.protocol.people, len(games.people)
    played = int(np.isfinite(games.by_section).sum())
    states = dict(each(tables.participants, "participant", "state"))
    unfinished = [person for person in games.people if states[person] != "ended"]
    says = f"{there} of {planned} planned people took part and played {played:,} games that count."
    if unfinished:
        says += f" {len(unfinished)} did not come to the end ({', '.join(unfinished)})."
    return Chapter(
        key="people",
        title="Who took part, and what is there",
        says=(says, *games.left_out),
        tables=(*_about(tables, games), _complete(tables, games, states)),
    )


def _about(tables: Tables, games: Games) -> tuple[Table, ...]:
    rows: list[tuple[Cell, ...]] = []
    ages = ages_of(tables)
    if ages:
        spread = f", SD {number_text(float(np.std(ages, ddof=1)))}" if len(ages) > 1 else ""
        rows.append(("age", f"M {number_text(float(np.mean(ages)))}{spread} years", len(ages)))
    for _, item in choice_items(tables.protocol, is_several=False):
        found = {person: options for (person, at), options in chosen(tables, item.id).items()
                 if at == 0 and options}  # fmt: skip
        if not found or any("Section" in option for option in item.options):
            continue
        for option in item.options:
            count = sum(option in options for options in found.values())
            rows.append((item.text, option, count))
    if not rows:
        return ()
    return (
        Table(name="participants", title="What participants said about themselves",
              columns=("question", "answer", "people"), rows=tuple(rows),
              note=f"{len(games.people)} people; an age that is no number is left out."),
    )  # fmt: skip


def ages_of(tables: Tables) -> list[float]:
    """Return the ages that can be read as years."""
    found: list[float] = []
    for construct, text in each(tables.questionnaire, "construct", "text"):
        if construct == "age":
            try:
                age = float(text.strip().split()[0].rstrip(".,")) if text.strip() else math.nan
            except ValueError:
                continue
            found += [age] if 0.0 < age < 130.0 else []
    return found


def _complete(tables: Tables, games: Games, states: dict[str, str]) -> Table:
    planned = sum(section.games for section in tables.protocol.section)
    beats = dict.fromkeys(games.people, 0)
    for person, contact, bpm, game in each(
        tables.heart_rate, "participant", "contact", "bpm", "game"
    ):
        if person in beats and contact and bpm > 0.0 and game:
            beats[person] += 1
    answers = dict.fromkeys(games.people, 0)
    for person, value, option, text in each(
        tables.questionnaire, "participant", "value", "option", "text"
    ):
        if person in answers and (value == value or option or text):
            answers[person] += 1
    counted = np.isfinite(games.by_section).sum(axis=(1, 2))
    return Table(
        name="completeness",
        title="What is there of each person",
        columns=("participant", "session", "games", "planned", "heart rates in games", "answers"),
        rows=tuple(
            (person, states[person], int(counted[k]), planned, beats[person], answers[person])
            for k, person in enumerate(games.people)
        ),
        note="Each statistic leaves out who lacks what it needs, and says how many.",
        is_folded=True,
    )
