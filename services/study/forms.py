"""Questionnaires and rankings: the questions a page shows, and whether answers fit them."""

from collections.abc import Sequence

from services.study.view import Answer, Item
from shared.study.protocol import Instrument


def items_of(instrument: Instrument, finished: Sequence[int] = ()) -> tuple[Item, ...]:
    """Return what a page shows of an instrument.

    Args:
        instrument: of the protocol.
        finished: numbers of the sections that a ranking puts in order.
    """
    return tuple(
        Item(
            id=item.id,
            text=item.text,
            scale="points" if isinstance(item.scale, int) else item.scale,
            points=item.scale if isinstance(item.scale, int) else 0,
            labels=instrument.labels,
            options=tuple(map(str, finished)) if item.scale == "ranking" else item.options,
            is_several=item.is_several,
            other=item.other,
            ends=(item.ends[0], item.ends[1]) if item.ends else ("", ""),
            is_required=not item.is_optional,
        )
        for item in instrument.item
    )


def lacks_of(items: Sequence[Item], answers: Sequence[Answer]) -> list[str]:
    """Return everything that is missing or wrong in the answers to a form; [] when it is whole."""
    given = {answer.item: answer for answer in answers}
    known = {item.id for item in items}
    lacks = [f"there is no question {name[:40]!r} here" for name in given if name not in known]
    if len(given) < len(answers):
        lacks.append("a question is answered twice")
    for item in items:
        answer = given.get(item.id)
        if item.is_required and (answer is None or is_empty(item, answer)):
            lacks.append(f"{item.id} has no answer")
        if answer is not None:
            lacks += _wrong(item, answer)
    return lacks


def is_empty(item: Item, answer: Answer) -> bool:
    """Return whether an answer says nothing about its item."""
    if item.scale == "points":
        return answer.value is None
    if item.scale == "choices":
        return not answer.choices
    if item.scale == "ranking":
        return not answer.ranks
    return not answer.text.strip()


def _wrong(item: Item, answer: Answer) -> list[str]:
    options = item.options if item.scale == "choices" else ()
    unknown = set(answer.choices) - set(options)
    ranked = len(item.options) if item.scale == "ranking" else 0
    highest = item.points if item.scale == "points" else 0
    may_write = item.scale == "open" or item.other in answer.choices
    lacks: list[str] = []
    if answer.value is not None and answer.value > highest:
        lacks.append(f"{item.id} is {answer.value}, expected at most {highest}")
    if unknown:
        lacks.append(f"{item.id} has no option {min(unknown)[:40]!r}")
    if len(set(answer.choices)) < len(answer.choices):
        lacks.append(f"{item.id} has an option twice")
    if len(answer.choices) > 1 and not item.is_several:
        lacks.append(f"{item.id} has {len(answer.choices)} options, expected one")
    if len(answer.ranks) not in (0, ranked) or any(rank > ranked for rank in answer.ranks):
        lacks.append(
            f"{item.id} has ranks {list(answer.ranks)}, expected {ranked} of 1 to {ranked}"
        )
    if answer.text and not may_write:
        lacks.append(f"{item.id} has a text, expected none")
    return lacks
