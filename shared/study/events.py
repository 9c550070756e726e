"""What happens in a session: the kinds of events that its journal holds, one a line."""

from typing import Annotated, Literal

import msgspec

Count = Annotated[int, msgspec.Meta(ge=0, le=2**53)]
"""Small enough to be a number anywhere."""
Instant = Annotated[int, msgspec.Meta(ge=0, le=2**63 - 1)]
"""Nanoseconds: on the wall clock since 1970, to the year 2262."""
Number = Annotated[float, msgspec.Meta(ge=-1e15, le=1e15)]

Outcome = Literal["finished", "void", "repeat"]
"""``finished``: it counts. ``void``: it does not, and is not played again. ``repeat``: it does not,
and is played again as the next attempt."""


class Answer(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What somebody answered to one item; nothing set where it was left out."""

    value: Count | None = None
    """On a scale of points, from 1, as ticked (a reversed item is turned by the analysis)."""
    chosen: tuple[str, ...] = ()
    """Of the options."""
    text: str = ""
    """In one's own words: an open item, or what ``other`` asked for."""


class SessionBegan(msgspec.Struct, frozen=True, kw_only=True, tag="session_began"):
    """The first event of a journal."""

    participant: str
    session: Count
    order: tuple[str, ...]
    """Labels of the conditions, blinded."""
    study: str
    """Name of the protocol."""
    protocol: str
    """SHA-256 of protocol.toml."""
    config: str
    """SHA-256 of the resolved settings of the processes."""
    commit: str
    version: str


class SessionResumed(msgspec.Struct, frozen=True, kw_only=True, tag="session_resumed"):
    """A runner took over after another one ended; monotonic times begin anew."""

    config: str
    commit: str
    version: str
    reason: str = ""


class StepBegan(msgspec.Struct, frozen=True, kw_only=True, tag="step_began"):
    """A step began, for the first time or again."""


class StepDone(msgspec.Struct, frozen=True, kw_only=True, tag="step_done"):
    """A step is over; a game's is, too, when all its attempts were void."""

    reason: str = ""
    """Why it ended early, where it did."""


class Consented(msgspec.Struct, frozen=True, kw_only=True, tag="consented"):
    """The participant agreed to every statement of the consent; which is kept word by word."""

    statements: tuple[str, ...]


class Measured(msgspec.Struct, frozen=True, kw_only=True, tag="measured"):
    """A baseline is over; of one that was interrupted and begun again, only this counts."""

    seconds: Number
    """How long it was."""
    beats: int
    """Measurements of the strap in it; 0: the baseline is missing."""
    beats_per_minute: float | None
    """Their mean."""


class GameStarted(msgspec.Struct, frozen=True, kw_only=True, tag="game_started"):
    """A bout was asked for at the referee; if it refuses, the game ends at once, void."""

    attempt: Count
    """Of this game, from 1."""
    bout: str
    """Its name at the referee, and of its archive."""
    policy: str
    """Player reference of the robot: ``sha256:HASH`` or ``scripted:NAME``."""
    seconds: Number
    speed: Number = 1.0


class GameEnded(msgspec.Struct, frozen=True, kw_only=True, tag="game_ended"):
    """A game that had started is over."""

    attempt: Count
    bout: str
    policy: str
    outcome: Outcome
    reason: str = ""
    """Why it does not count."""
    score: Number | None = None
    """The antagonist's; None where nobody judged it to its end."""
    attack_steps: Count | None = None
    penalty_steps: Count | None = None
    camping_steps: Count | None = None
    steps: Count | None = None
    """Control steps that were judged."""
    seconds: Number | None = None
    """Game time (s)."""
    archive: str = ""
    """Folder of its archive in the session's folder: ``bouts/NAME``."""


class Answered(msgspec.Struct, frozen=True, kw_only=True, tag="answers"):
    """An instrument was filled in; later answers of the same step replace earlier ones."""

    instrument: str
    answers: dict[str, Answer]
    """By id of the item."""


class Ranked(msgspec.Struct, frozen=True, kw_only=True, tag="ranking"):
    """The finished sections were compared."""

    instrument: str
    ranks: dict[str, dict[Count, Count]]
    """By id of the item: section -> rank, 1 the least; sections may share a rank."""


class Noted(msgspec.Struct, frozen=True, kw_only=True, tag="note"):
    """The researcher wrote something down."""

    text: str


class Voided(msgspec.Struct, frozen=True, kw_only=True, tag="voided"):
    """The researcher took a finished game out of the data; it is not played again."""

    attempt: Count
    reason: str


class Repeated(msgspec.Struct, frozen=True, kw_only=True, tag="repeated"):
    """The researcher took a game out of the data, and it is played again."""

    attempt: Count
    """The one that is taken out."""
    reason: str


class Paused(msgspec.Struct, frozen=True, kw_only=True, tag="paused"):
    """The session waits; nobody plays."""

    reason: str = ""


class Unpaused(msgspec.Struct, frozen=True, kw_only=True, tag="unpaused"):
    """The session goes on."""


class Aborted(msgspec.Struct, frozen=True, kw_only=True, tag="aborted"):
    """The session ended before its last step."""

    reason: str


class SessionEnded(msgspec.Struct, frozen=True, kw_only=True, tag="session_ended"):
    """The last step is done."""


What = (
    SessionBegan | SessionResumed | StepBegan | StepDone | Consented | Measured | GameStarted
    | GameEnded | Answered | Ranked | Noted | Voided | Repeated | Paused | Unpaused | Aborted
    | SessionEnded
)  # fmt: skip


class Event(msgspec.Struct, frozen=True, kw_only=True):
    """One line of a journal."""

    number: Count
    """From 1, without a gap."""
    t_ns: Instant
    """Monotonic clock of the runner; begins anew with every ``session_resumed``."""
    wall_ns: Instant
    step: str = ""
    """Id of the step that it belongs to."""
    ask: str = ""
    """Id of the ask of a page that it came of: asked again, it is not done again."""
    what: What

    @property
    def kind(self) -> str:
        """Return the name of what happened: ``game_started``."""
        tag = type(self.what).__struct_config__.tag
        assert isinstance(tag, str)
        return tag
