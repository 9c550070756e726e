"""Study folders with known numbers in them, written by the study's own writers."""

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType

import numpy as np

from shared.study.analysis.games import Games
from shared.study.folder import PARTICIPANTS, Study
from shared.study.instants import text_of
from shared.study.recorded import GAMES, HEART_RATE, QUESTIONNAIRE, RANKINGS
from shared.study.rows import (
    GameRow,
    HeartRateRow,
    ParticipantRow,
    QuestionnaireRow,
    RankingRow,
)
from shared.study.tsv import write_table
from tests.unit.study.made import AT, study_in

BEGIN_NS = round(AT * 1e9)


@dataclasses.dataclass
class Person:
    """What somebody did, by condition or section."""

    scores: Mapping[str, Sequence[float]]
    """By name of the condition; NaN: void."""
    resting: float = 70.0
    walking: float = 90.0
    peaks: Mapping[str, Sequence[float]] = dataclasses.field(default_factory=dict)
    """1/min, by name of the condition."""
    answers: Mapping[tuple[int, str], int | Sequence[str] | str] = dataclasses.field(
        default_factory=dict
    )
    """By section (0: outside) and item: points, options, or words."""
    ranks: Mapping[str, Mapping[str, int]] = dataclasses.field(default_factory=dict)
    """By item and name of the condition."""


def write_study(
    folder: Path, name: str, people: int, make: Callable[[int, list[str]], Person], seed: int = 7
) -> Study:
    """Write a study of which everybody has played.

    Args:
        folder: new.
        name: of the shipped protocol.
        people: how many.
        make: what the k-th did, given the names of the conditions in their order.
        seed: of the orders.
    """
    study = study_in(folder, name, people, seed)
    names = study.conditions
    rows: list[ParticipantRow] = []
    for k, assignment in enumerate(study.assignments):
        order = [names[label] for label in assignment.order]
        person = make(k, order)
        _write(study, assignment.participant, assignment.order, order, person)
        games = sum(np.isfinite(scores).sum() for scores in person.scores.values())
        rows.append(
            ParticipantRow(
                participant=assignment.participant, session=1, order=",".join(assignment.order),
                state="ended", games=int(games), t_ns=0, wall=text_of(BEGIN_NS),
                wall_ended=text_of(BEGIN_NS), protocol=study.protocol_hash, config="c" * 64,
                commit="abc", version="1.0",
            )
        )  # fmt: skip
    write_table(folder / PARTICIPANTS, rows, ParticipantRow)
    return study


def _write(study, participant, labels, order, person):
    folder = study.session_folder(participant)
    folder.mkdir(parents=True)
    who = {"participant": participant, "session": 1, "config": "c" * 64}
    clock = iter(range(10**6))

    def when():
        at = BEGIN_NS + next(clock) * 10**9
        return {"t_ns": at, "wall": text_of(at)}

    games, beats, answers, ranks = [], [], [], []
    for name, rate in (("resting", person.resting), ("walking", person.walking)):
        for wobble in (-2.0, 2.0):
            at = {"step": f"baseline-{name}", "section": 0, "condition": "", "game": 0}
            beats.append(_beat(who, when(), at | {"attempt": 0, "policy": ""}, rate + wobble))
    for section, (label, name) in enumerate(zip(labels, order, strict=True), start=1):
        policy = f"sha256:{name}"
        for game, score in enumerate(person.scores[name], start=1):
            is_there = bool(np.isfinite(score))
            games.append(
                GameRow(
                    **who, **when(), section=section, condition=label, game=game, attempt=1,
                    outcome="finished" if is_there else "void", is_recorded=True,
                    score=float(score) if is_there else None, bout=f"s{section}-g{game:02d}",
                    policy=policy, commit="abc",
                )
            )  # fmt: skip
            for share in (0.9, 1.0) if name in person.peaks else ():
                at = {"step": f"s{section}-g{game:02d}", "section": section, "condition": label}
                at |= {"game": game, "attempt": 1, "policy": policy}
                rate = float(share * person.peaks[name][game - 1])
                beats.append(_beat(who, when(), at, rate))
    items = {
        item.id: (instrument.name, item)
        for instrument in study.protocol.instrument
        for item in instrument.item
    }
    for (section, item), given in person.answers.items():
        instrument, asked = items[item]
        options = [""] if isinstance(given, int | str) else list(given) or [""]
        answers += [
            QuestionnaireRow(
                **who, **when(), section=section, condition=labels[section - 1] if section else "",
                step=f"q-{instrument}", instrument=instrument, item=item,
                construct=asked.construct, reversed=asked.is_reversed,
                value=given if isinstance(given, int) else None, option=option,
                text=given if isinstance(given, str) else "", policy="",
            )
            for option in options
        ]  # fmt: skip
    for item, places in person.ranks.items():
        ranks += [
            RankingRow(
                **who, **when(), after=len(order), instrument=items[item][0], question=item,
                section=section, condition=label, rank=places[name], policy="",
            )
            for section, (label, name) in enumerate(zip(labels, order, strict=True), start=1)
        ]  # fmt: skip
    write_table(folder / GAMES, games, GameRow)
    write_table(folder / HEART_RATE, beats, HeartRateRow)
    write_table(folder / QUESTIONNAIRE, answers, QuestionnaireRow)
    write_table(folder / RANKINGS, ranks, RankingRow)


def _beat(who, when, at, rate):
    return HeartRateRow(**who, **when, **at, bpm=rate, contact=True, source="strap")


def switched(
    generator: np.random.Generator, levels: Sequence[float], first: int, orders: Sequence[str],
    games: int, *, pace: float = 10.0, drop: float = 0.0,
) -> Games:  # fmt: skip
    """Return games of people who learn on through all sections, ``drop`` points lost at a switch.

    Args:
        generator: of scores and paces.
        levels: how easy conditions a, b, ... are (points).
        first: how many of them everybody meets first.
        orders: of each person: ``acb``.
        games: of a section.
        pace: mean of what people learn in a game (points).
        drop: points lost for good at each switch but those of the first sections.
    """
    names = tuple("abcdef"[: len(levels)])
    shape = (len(orders), len(levels), games)
    by_section = generator.normal(0.0, 100.0, shape)
    by_section += generator.normal(pace, pace / 2.0, (len(orders), 1, 1)) * np.arange(
        len(levels) * games
    ).reshape(len(levels), games)
    by_section -= drop * np.maximum(np.arange(len(levels)) - first, 0)[:, None]
    by_condition = np.empty(shape)
    for k, order in enumerate(orders):
        for section, name in enumerate(order):
            by_section[k, section] += levels[names.index(name)]
            by_condition[k, names.index(name)] = by_section[k, section]
    return Games(
        people=tuple(f"sub-{k + 1:02d}" for k in range(len(orders))), conditions=names,
        first=names[:first], by_section=by_section, by_condition=by_condition,
        orders={f"sub-{k + 1:02d}": tuple(order) for k, order in enumerate(orders)},
        bouts=MappingProxyType({}), left_out=(),
    )  # fmt: skip


def line_scores(
    slope: float, r: float, mean: float, people: int, games: int, seed: int
) -> np.ndarray:
    """Return float64[people, games], scores whose regression on game number has this slope and r.

    Residuals are made orthogonal to the game number, and scaled to the variance that r leaves.
    """
    x = np.tile(np.arange(1.0, games + 1.0), people)
    noise = np.random.default_rng(seed).standard_normal(len(x))
    noise += np.repeat(np.random.default_rng(seed + 1).standard_normal(people), games)
    design = np.column_stack([np.ones(len(x)), x])
    noise -= design @ np.linalg.lstsq(design, noise, rcond=None)[0]
    explained = slope**2 * np.sum((x - x.mean()) ** 2)
    noise *= np.sqrt(explained * (1.0 / r**2 - 1.0) / np.sum(noise**2))
    return (mean + slope * (x - x.mean()) + noise).reshape(people, games)
