"""Answers and ranks as arrays: a row a person, the last answer to each question."""

import dataclasses
from collections.abc import Sequence

import msgspec
import numpy as np
from numpy.typing import NDArray

from shared.study.analysis.games import each
from shared.study.protocol import Instrument, Item, Protocol
from shared.study.tables import Tables

Floats = NDArray[np.float64]


@dataclasses.dataclass(frozen=True)
class Scale:
    """An instrument of points, as it was answered at one occasion or after every section."""

    instrument: Instrument
    constructs: tuple[str, ...]
    conditions: tuple[str, ...]
    """Of the columns of ``items``; one empty name where it was asked outside the sections."""
    items: Floats
    """float64[n, C, I], turned round where the item is reversed; NaN without an answer."""

    @property
    def points(self) -> int:
        """Return how many points there are to choose from."""
        scale = self.instrument.item[0].scale
        assert isinstance(scale, int)
        return scale

    def of(self, construct: str) -> Floats:
        """Return float64[n, C, i], the items of a construct."""
        kept = [k for k, item in enumerate(self.instrument.item) if item.construct == construct]
        return self.items[:, :, kept]


def scales_of(tables: Tables, people: Sequence[str], conditions: Sequence[str]) -> list[Scale]:
    """Return every instrument of points that somebody answered."""
    found: list[Scale] = []
    for instrument in tables.protocol.instrument:
        points = [item for item in instrument.item if isinstance(item.scale, int)]
        if not points:
            continue
        made = _scale(tables, instrument, points, people, conditions)
        found += [] if made is None else [made]
    return found


def _scale(
    tables: Tables,
    instrument: Instrument,
    points: Sequence[Item],
    people: Sequence[str],
    conditions: Sequence[str],
) -> Scale | None:
    wanted = {item.id: (k, item) for k, item in enumerate(points)}
    rows = [
        (person, condition if section else "", item, value)
        for person, section, condition, name, item, value in each(
            tables.questionnaire, "participant", "section", "condition", "instrument", "item",
            "value",
        )
        if name == instrument.name and item in wanted and person in people and value == value
    ]  # fmt: skip
    met = {condition for _, condition, _, _ in rows}
    columns = tuple(name for name in ("", *conditions) if name in met)
    if not columns:
        return None
    items = np.full((len(people), len(columns), len(points)), np.nan)
    for person, condition, item, value in rows:
        k, asked = wanted[item]
        place = (people.index(person), columns.index(condition), k)
        items[place] = asked.scored(int(value))
    only = msgspec.structs.replace(instrument, item=tuple(points))
    constructs = tuple(dict.fromkeys(item.construct for item in points))
    return Scale(only, constructs, columns, items)


def ranks_of(
    tables: Tables, people: Sequence[str], question: str
) -> dict[tuple[str, int], tuple[str, float]]:
    """Return condition and rank by person and section, of the ranking after the last section."""
    last: dict[str, int] = {}
    rows = [
        (person, after, section, condition, rank)
        for person, after, asked, section, condition, rank in each(
            tables.rankings, "participant", "after", "question", "section", "condition", "rank"
        )
        if asked == question and person in people
    ]
    for person, after, *_ in rows:
        last[person] = max(after, last.get(person, 0))
    return {
        (person, section): (condition, float(rank))
        for person, after, section, condition, rank in rows
        if after == last[person]
    }


def choice_items(protocol: Protocol, *, is_several: bool) -> list[tuple[Instrument, Item]]:
    """Return the questions with options, of one answer or of several."""
    return [
        (instrument, item)
        for instrument in protocol.instrument
        for item in instrument.item
        if item.scale == "choices" and item.is_several == is_several
    ]


def chosen(tables: Tables, item: str) -> dict[tuple[str, int], list[str]]:
    """Return the options chosen by person and section."""
    found: dict[tuple[str, int], list[str]] = {}
    for person, section, asked, option in each(
        tables.questionnaire, "participant", "section", "item", "option"
    ):
        if asked == item:
            found.setdefault((person, section), []).extend([option] if option else [])
    return found
