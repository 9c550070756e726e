"""The games of a study as arrays: person by section by game, and person by condition by game."""

import dataclasses
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from shared.study.analysis.finding import missing_text
from shared.study.tables import Columns, Tables

Floats = NDArray[np.float64]


@dataclasses.dataclass(frozen=True)
class Games:
    """Scores of the games that count; NaN where a game was not played to its end."""

    people: tuple[str, ...]
    """Everybody with a session, in the tables' order."""
    conditions: tuple[str, ...]
    """As the tables call them, in alphabetical order, those that come first for everybody first."""
    first: tuple[str, ...]
    """Conditions that come first for everybody, by the protocol's ``order.first``: nothing tells
    them from their section."""
    by_section: Floats
    """float64[n, S, G]."""
    by_condition: Floats
    """float64[n, C, G]."""
    orders: Mapping[str, tuple[str, ...]]
    """Conditions in the order of the sections, by person."""
    bouts: Mapping[tuple[int, int, int], tuple[int, str]]
    """Session and name of the archive, by person, section and game, each from 0."""
    left_out: tuple[str, ...]

    @property
    def numbers(self) -> Floats:
        """Return float64[G], the games' numbers in their section."""
        return np.arange(1.0, self.by_section.shape[2] + 1.0)

    @property
    def means(self) -> Floats:
        """Return float64[n, C], each person's mean score by condition."""
        return mean_of(self.by_condition)


def each(columns: Columns, *names: str) -> Iterator[tuple[Any, ...]]:
    """Return the rows of a table, of these columns, as Python values."""
    return zip(*(_plain(columns[name]) for name in names), strict=True)


def mean_of(cube: Floats) -> Floats:
    """Return the mean over the last axis of what is there; NaN where nothing is."""
    there = np.isfinite(cube)
    count = there.sum(axis=-1)
    total = np.where(there, cube, 0.0).sum(axis=-1)
    return np.where(count > 0, total / np.maximum(count, 1), np.nan)


def mean_there(values: Floats) -> float:
    """Return the mean of what is there, NaN where nothing is."""
    there = values[np.isfinite(values)]
    return float(there.mean()) if len(there) else float("nan")


def games_of(tables: Tables) -> Games:
    """Return the games of a study that count: finished, recorded, the last attempt at each."""
    people = tuple(dict.fromkeys(tables.participants["participant"]))
    protocol = tables.protocol
    orders = orders_of(tables)
    conditions, first = _conditions(orders, len(protocol.order.first))
    shape = (len(people), len(protocol.section), max(s.games for s in protocol.section))
    by_section, by_condition = (
        np.full(shape, np.nan),
        np.full((shape[0], max(len(conditions), 1), shape[2]), np.nan),
    )
    bouts: dict[tuple[int, int, int], tuple[int, str]] = {}
    index = {person: k for k, person in enumerate(people)}
    other = {"warm-up": 0, "void or repeated": 0, "foreign": 0}
    names = ("participant", "section", "game", "condition", "outcome", "is_recorded", "score",
             "session", "bout")  # fmt: skip
    for person, section, game, condition, outcome, is_recorded, score, session, bout in each(
        tables.games, *names
    ):
        if not is_recorded:
            other["warm-up"] += 1
        elif outcome != "finished" or not np.isfinite(score):
            other["void or repeated"] += 1
        elif person not in index or condition not in conditions:
            other["foreign"] += 1
        else:
            at = (index[person], section - 1, game - 1)
            by_section[at] = score
            by_condition[at[0], conditions.index(condition), at[2]] = score
            bouts[at] = (session, bout)
    planned = sum(section.games for section in protocol.section) * len(people)
    return Games(
        people=people,
        conditions=conditions,
        first=first,
        by_section=by_section,
        by_condition=by_condition,
        orders=orders,
        bouts=bouts,
        left_out=(
            *missing_text(other["warm-up"], "games", "warm-up, not recorded"),
            *missing_text(other["void or repeated"], "attempts", "void, repeated or not ended"),
            *missing_text(other["foreign"], "games", "of nobody in participants.tsv"),
            *missing_text(planned - len(bouts), "planned games", "never played to their end"),
        ),
    )


def orders_of(tables: Tables) -> dict[str, tuple[str, ...]]:
    """Return everybody's conditions in the order of the sections."""
    rows = each(tables.participants, "participant", "order")
    return {person: tuple(order.split(",")) for person, order in rows if order}


def _conditions(
    orders: Mapping[str, Sequence[str]], first: int
) -> tuple[tuple[str, ...], tuple[str, ...]]:  # fmt: skip
    """Return all conditions, and those of the first sections, which are the same for everybody."""
    found = sorted({condition for order in orders.values() for condition in order})
    begin = tuple(next(iter(orders.values()), ())[:first])
    return (*begin, *(name for name in found if name not in begin)), begin


def _plain(column: Any) -> list[Any]:
    return column.tolist() if isinstance(column, np.ndarray) else list(column)
