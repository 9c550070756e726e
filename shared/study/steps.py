"""One session of a protocol, laid out as the steps that are walked one after the other."""

from collections.abc import Iterator, Sequence
from typing import Final, Literal

import msgspec

from shared.study.protocol import Instrument, Protocol, Section

StepKind = Literal[
    "consent", "instruction", "baseline", "explore", "warm_up", "game", "rest", "questionnaire",
    "ranking", "debrief",
]  # fmt: skip
GAME_KINDS: Final[tuple[StepKind, ...]] = ("warm_up", "game")
"""Steps in which a bout is played."""


class Step(msgspec.Struct, frozen=True, kw_only=True):
    """One thing to be done."""

    id: str
    """Stable and readable: ``baseline-walking``, ``s2-g03``, ``s2-q-adjectives``."""
    kind: StepKind
    section: int = 0
    """From 1; 0 outside the sections."""
    game: int = 0
    """From 1 in its section, or among the warm-up games; 0 where no game is played."""
    condition: str = ""
    """Name of the condition of its section: for the software, never for the participant."""
    player: str = ""
    """Whom the game is played against, as `riposte play --protagonist` takes it."""
    seconds: float = 0.0
    """How long it takes (s); 0: until somebody says that it is done."""
    title: str
    text: str = ""
    instrument: str = ""
    """Name of the instrument that is filled in."""
    is_recorded: bool = False
    """Its data count: games of a section do, warm-up games do not."""
    speed: float = 1.0
    """Share of the robot's speed in a game that counts."""
    rest_below: float = 0.0
    """A rest goes on until the heart rate is below this (1/min); 0 looks at the time only."""


def steps_of(protocol: Protocol, order: Sequence[str]) -> tuple[Step, ...]:
    """Return the steps of one session.

    Args:
        protocol: the study.
        order: names of all conditions, in the order in which this participant meets them.

    Raises:
        ValueError: ``order`` is no order of the protocol's conditions.
    """
    names = [condition.name for condition in protocol.condition]
    if sorted(order) != sorted(names):
        raise ValueError(
            f"an order must hold each condition once ({', '.join(names)}), "
            f"not {', '.join(order) or 'nothing'}"
        )
    steps = list(_before(protocol))
    for number, (section, condition) in enumerate(
        zip(protocol.section, order, strict=True), start=1
    ):
        steps += _section(protocol, section, number, condition)
    steps += [_asked(protocol, name) for name in protocol.end.instruments]
    end = protocol.end
    steps.append(Step(id="debrief", kind="debrief", title=end.title, text=end.text))
    return tuple(steps)


def _before(protocol: Protocol) -> Iterator[Step]:
    consent = protocol.consent
    yield Step(id="consent", kind="consent", title=consent.title, text=consent.text)
    for name in protocol.start.instruments:
        yield _asked(protocol, name)
    for each in protocol.baseline:
        yield Step(
            id=f"baseline-{each.name}", kind="baseline", seconds=each.seconds, title=each.title,
            text=each.text, is_recorded=True,
        )  # fmt: skip
    if (told := protocol.instruction) is not None:
        yield Step(id="instruction", kind="instruction", title=told.title, text=told.text)
    if (explore := protocol.explore) is not None:
        yield Step(
            id="explore", kind="explore", seconds=explore.seconds, title=explore.title,
            text=explore.text,
        )  # fmt: skip
    if (warm_up := protocol.warm_up) is not None:
        for game in range(1, warm_up.games + 1):
            yield Step(
                id=f"warm-up-{game}", kind="warm_up", game=game, player=warm_up.player,
                seconds=protocol.game.seconds, title=f"{warm_up.title} {game}",
                text=warm_up.text, speed=warm_up.speed,
            )  # fmt: skip


def _section(protocol: Protocol, section: Section, number: int, condition: str) -> Iterator[Step]:
    player = protocol.condition_named(condition).player
    place = f"Section {number}"
    if section.text:
        yield Step(
            id=f"s{number}-instruction", kind="instruction", section=number, condition=condition,
            title=place, text=section.text,
        )  # fmt: skip
    for game in range(1, section.games + 1):
        yield Step(
            id=f"s{number}-g{game:02d}", kind="game", section=number, game=game,
            condition=condition, player=player, seconds=protocol.game.seconds,
            title=f"{place}, game {game} of {section.games}", is_recorded=True,
        )  # fmt: skip
        if game < section.games and section.rest:
            yield Step(
                id=f"s{number}-rest-{game:02d}", kind="rest", section=number,
                condition=condition, seconds=section.rest, title="Rest", is_recorded=True,
                rest_below=section.rest_below,
            )  # fmt: skip
    for name in section.instruments:
        yield _asked(protocol, name, number, condition)


def _asked(protocol: Protocol, name: str, section: int = 0, condition: str = "") -> Step:
    instrument: Instrument = protocol.instrument_named(name)
    place = f"s{section}-" if section else ""
    letter = "r" if instrument.is_ranking else "q"
    return Step(
        id=f"{place}{letter}-{name}",
        kind="ranking" if instrument.is_ranking else "questionnaire",
        section=section,
        condition=condition,
        title=instrument.title,
        text=instrument.text,
        instrument=name,
        is_recorded=True,
    )
