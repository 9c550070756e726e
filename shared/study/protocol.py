"""What a study is: a TOML file that says who plays what, for how long, and what is asked.

The file is data only: `load_protocol` of ``shared/study/protocol_file.py`` reads and checks it,
``shared/study/steps.py`` lays it out as the steps of one session.
"""

from typing import Annotated, Final, Literal, TypeVar

import msgspec

from shared.config.ranges import check_ranges

SCHEMA: Final = 1
LONGEST_TEXT: Final = 20_000
"""Of one text (characters)."""

NAME: Final = "^[a-z0-9][a-z0-9-]{0,39}$"
ITEM_ID: Final = "^[A-Za-z0-9][A-Za-z0-9_-]{0,39}$"
ONE_LINE: Final = r"^[^\t\r\n]*$"
LANGUAGE: Final = "^[a-z]{2,3}(-[A-Za-z0-9]{2,8})?$"

Name = Annotated[str, msgspec.Meta(pattern=NAME)]
"""Small letters, digits and hyphens: it becomes a part of ids and of file names."""
ItemId = Annotated[str, msgspec.Meta(pattern=ITEM_ID)]
Line = Annotated[str, msgspec.Meta(min_length=1, max_length=400, pattern=ONE_LINE)]
"""One line for people."""
OptionalLine = Annotated[str, msgspec.Meta(max_length=400, pattern=ONE_LINE)]
Text = Annotated[str, msgspec.Meta(max_length=LONGEST_TEXT)]
"""Paragraphs for people, an empty line between them."""

Language = Annotated[str, msgspec.Meta(pattern=LANGUAGE)]
Scale = int | Literal["choices", "ranking", "open"]
OrderKind = Literal["fixed", "random", "williams"]


class Consent(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What a participant agrees to before anything is measured."""

    title: Line = "Consent"
    text: Annotated[str, msgspec.Meta(min_length=1, max_length=LONGEST_TEXT)]
    statements: Annotated[tuple[Line, ...], msgspec.Meta(min_length=1, max_length=20)]
    """Each must be ticked, or the session ends."""


class Order(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """In which order a participant meets the conditions, one in each section."""

    kind: OrderKind = "fixed"
    """``fixed``: as listed; ``random``: drawn for each participant; ``williams``: balanced."""
    first: tuple[Name, ...] = ()
    """Conditions that come first for everybody, in this order; the others are ordered."""


class Condition(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Whom a participant plays against in a section."""

    name: Name
    player: Line
    """As `riposte play --protagonist` takes it: ``style-1``, ``scripted:heuristic``, a file."""
    about: OptionalLine = ""
    """For the report; no participant reads it."""


class Section(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Consecutive games against one condition, and what is asked after them."""

    games: int
    rest: float
    """Between two games (s); none after the last."""
    rest_below: float = 0.0
    """A rest goes on until the heart rate is below this (1/min); 0 looks at the time only."""
    text: Text = ""
    """Read before the first game; no such step where it is empty."""
    instruments: tuple[Name, ...] = ()
    """Asked after the last game, in this order."""

    def __post_init__(self) -> None:
        """Check the ranges."""
        check_ranges(
            self, ("games", 1, 99), ("rest", 0.0, 3600.0), ("rest_below", 0.0, 250.0)
        )  # fmt: skip


class Baseline(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A time in which the heart rate is measured without a game."""

    name: Name
    """``resting``, ``walking``."""
    title: Line
    text: Text = ""
    seconds: float

    def __post_init__(self) -> None:
        """Check the range."""
        check_ranges(self, ("seconds", 1.0, 3600.0))


class Instruction(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What a participant is told before the first game."""

    title: Line = "The game"
    text: Annotated[str, msgspec.Meta(min_length=1, max_length=LONGEST_TEXT)]


class Exploration(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A time to find the invisible target by its sound; nobody defends it."""

    title: Line = "Find the target"
    text: Text = ""
    seconds: float

    def __post_init__(self) -> None:
        """Check the range."""
        check_ranges(self, ("seconds", 1.0, 3600.0))


class WarmUp(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Games to get used to the robot: slowed down, and not recorded."""

    title: Line = "Warm-up"
    text: Text = ""
    games: int
    speed: float
    """Share of the robot's speed in a game that counts."""
    player: Line
    """Whom they are played against, as in a condition."""

    def __post_init__(self) -> None:
        """Check the ranges."""
        check_ranges(self, ("games", 1, 99), ("speed", 0.05, 1.0))


class Game(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One game."""

    seconds: float = 20.0
    score: Literal["after", "always", "never"] = "after"
    """When the participant's page shows it: after a game, while it is on as well, or not at all."""

    def __post_init__(self) -> None:
        """Check the range: the referee plays none that is longer."""
        check_ranges(self, ("seconds", 1.0, 600.0))


class Item(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One question of an instrument."""

    id: ItemId
    construct: ItemId
    """What it measures: ``PU``; items of one construct are taken together."""
    text: Line
    scale: Scale = 5
    """Points of a scale, or ``choices``, ``ranking`` (of the finished sections) or ``open``."""
    is_reversed: bool = False
    """Agreement counts against the construct (scales only)."""
    options: tuple[Line, ...] = ()
    """What can be chosen (choices only)."""
    is_several: bool = False
    """More than one may be chosen (choices only)."""
    other: OptionalLine = ""
    """The option that asks for words of one's own, one of ``options`` (choices only)."""
    ends: tuple[Line, ...] = ()
    """Least and most (ranking only): ``("least enjoyable", "most enjoyable")``."""
    is_optional: bool = False
    """It may be left without an answer."""

    def __post_init__(self) -> None:
        """Check that what is said goes with the scale."""
        if isinstance(self.scale, int) and not 2 <= self.scale <= 11:
            raise ValueError(f"scale ({self.scale}) must have 2 to 11 points")
        is_points, is_choices = isinstance(self.scale, int), self.scale == "choices"
        if self.is_reversed and not is_points:
            raise ValueError(f"is_reversed is for scales of points, not for {self.scale!r}")
        if is_choices and len(self.options) < 2:
            raise ValueError('options must have at least 2 entries where scale = "choices"')
        if self.options and not is_choices:
            raise ValueError(f'options are for scale = "choices", not for {self.scale!r}')
        if len(set(self.options)) < len(self.options):
            raise ValueError("options has an entry twice")
        if self.is_several and not is_choices:
            raise ValueError(f'is_several is for scale = "choices", not for {self.scale!r}')
        if self.other and self.other not in self.options:
            raise ValueError(f"other ({self.other!r}) must be one of the options")
        if len(self.ends) != (2 if self.scale == "ranking" else 0):
            raise ValueError('ends must name least and most where scale = "ranking", else nothing')

    def scored(self, value: int) -> int:
        """Return an answer of a scale of points, turned round where the item is reversed."""
        assert isinstance(self.scale, int)
        return self.scale + 1 - value if self.is_reversed else value


class Instrument(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Questions that stand on one page; all of them rank, or none does."""

    name: Name
    title: Line
    text: Text = ""
    """Above the questions."""
    source: OptionalLine = ""
    """Where the questions come from; for the methods paragraph."""
    labels: tuple[OptionalLine, ...] = ()
    """Of the points of a scale, from 1 up; none, or as many as there are points."""
    is_paged: bool = False
    """One question a screen, rather than a list (not for rankings)."""
    item: Annotated[tuple[Item, ...], msgspec.Meta(min_length=1, max_length=60)]

    @property
    def is_ranking(self) -> bool:
        """Return whether it compares the finished sections."""
        return self.item[0].scale == "ranking"


class Ending(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What is asked after the last section, and what a participant is told at last."""

    instruments: tuple[Name, ...] = ()
    title: Line = "Thank you"
    text: Text = ""


class Beginning(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What is asked after the consent, before anything is measured."""

    instruments: tuple[Name, ...] = ()


class Protocol(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A study, as its TOML file holds it."""

    schema: Literal[1] = SCHEMA
    name: Name
    title: Line
    source: OptionalLine = ""
    """The publication that it follows."""
    people: int
    """How many participants are planned."""
    language: Language = "en"
    """Of the texts, and of the participant's page where ``static/words.js`` has it: en, de."""
    consent: Consent
    order: Order = Order()
    game: Game = Game()
    start: Beginning = Beginning()
    baseline: tuple[Baseline, ...] = ()
    instruction: Instruction | None = None
    explore: Exploration | None = None
    warm_up: WarmUp | None = None
    condition: Annotated[tuple[Condition, ...], msgspec.Meta(min_length=1, max_length=26)]
    section: Annotated[tuple[Section, ...], msgspec.Meta(min_length=1, max_length=26)]
    """One for each condition."""
    instrument: tuple[Instrument, ...] = ()
    end: Ending = Ending()

    def __post_init__(self) -> None:
        """Check the range."""
        check_ranges(self, ("people", 1, 9999))

    def condition_named(self, name: str) -> Condition:
        """Return a condition.

        Raises:
            KeyError: there is none of this name.
        """
        return _named(self.condition, name)

    def instrument_named(self, name: str) -> Instrument:
        """Return an instrument.

        Raises:
            KeyError: there is none of this name.
        """
        return _named(self.instrument, name)


_N = TypeVar("_N", Condition, Instrument)


def _named(entries: tuple[_N, ...], name: str) -> _N:
    for entry in entries:
        if entry.name == name:
            return entry
    raise KeyError(name)
