"""The rows of a study's tables. Every column is written for everybody: ``n/a`` where it is nothing.

``condition`` is the blinded label. ``t_ns`` is the runner's monotonic clock, which begins anew when
a session is resumed; ``wall`` is ISO 8601 in UTC. ``policy`` is the player reference of the robot,
``config`` the SHA-256 of the resolved settings.
"""

from typing import Final

import msgspec

SCHEMA: Final = 1
"""Of the tables; goes up when a column changes its meaning."""


class ParticipantRow(msgspec.Struct, frozen=True, kw_only=True):
    """A session of a participant (``participants.tsv``)."""

    participant: str
    """``sub-01``."""
    session: int
    """From 1."""
    order: str
    """Labels of the conditions in the order of the sections: ``B,A``."""
    state: str
    """``going``, ``ended`` or ``aborted``."""
    games: int
    """Games that count."""
    t_ns: int
    wall: str
    """When it began."""
    wall_ended: str
    """Last event."""
    protocol: str
    """SHA-256 of protocol.toml as the session began."""
    config: str
    schema: int = SCHEMA
    version: str = ""
    """Of Riposte."""
    commit: str = ""


class GameRow(msgspec.Struct, frozen=True, kw_only=True):
    """An attempt at a game (``games.tsv``)."""

    participant: str
    session: int
    section: int
    """From 1; 0 for a warm-up game."""
    condition: str
    game: int
    """From 1 in its section."""
    attempt: int
    """From 1 in its game."""
    outcome: str
    """``finished``; ``void`` and ``repeat`` do not count, nor does ``running``."""
    is_recorded: bool
    """False for warm-up games, which are no data."""
    score: float | None = None
    """The participant's; nothing where the game was not judged to its end."""
    attack_steps: int | None = None
    penalty_steps: int | None = None
    camping_steps: int | None = None
    steps: int | None = None
    """Control steps of 10 ms that were judged."""
    seconds: float | None = None
    """Game time (s)."""
    reason: str = ""
    """Why it does not count."""
    t_ns: int
    """Of its start."""
    wall: str
    bout: str
    """Name of its archive in ``bouts/``."""
    policy: str
    config: str
    schema: int = SCHEMA
    commit: str = ""


class HeartRateRow(msgspec.Struct, frozen=True, kw_only=True):
    """A measurement of the heart rate (``hr.tsv``)."""

    participant: str
    session: int
    t_ns: int
    wall: str
    bpm: float
    """Beats per minute."""
    contact: bool
    """The sensor touches skin; without it the number means nothing."""
    step: str
    """Step of the session at that time."""
    section: int
    condition: str
    game: int
    """0 where no game was played."""
    attempt: int
    """0 where no game was played."""
    source: str
    """The sensor."""
    policy: str
    config: str
    schema: int = SCHEMA


class QuestionnaireRow(msgspec.Struct, frozen=True, kw_only=True):
    """An answer (``questionnaire.tsv``); several rows where several options were chosen."""

    participant: str
    session: int
    section: int
    """After which it was asked; 0 before the first and after the last section."""
    condition: str
    step: str
    instrument: str
    item: str
    construct: str
    reversed: bool
    """Whether agreement counts against the construct; ``value`` is as ticked."""
    value: int | None = None
    """Points from 1, or the number of the option from 1; nothing where left out."""
    option: str = ""
    """The option that was chosen."""
    text: str = ""
    """In the participant's own words."""
    t_ns: int
    wall: str
    policy: str
    config: str
    schema: int = SCHEMA


class RankingRow(msgspec.Struct, frozen=True, kw_only=True):
    """The rank of a section (``rankings.tsv``)."""

    participant: str
    session: int
    after: int
    """Section after which it was asked; the ranking of all sections is the one after the last."""
    instrument: str
    question: str
    """Id of the item: ``enjoyment``."""
    section: int
    condition: str
    rank: int
    """1 = least; sections may share a rank."""
    t_ns: int
    wall: str
    policy: str
    config: str
    schema: int = SCHEMA


class EventRow(msgspec.Struct, frozen=True, kw_only=True):
    """An event of the journal (``events.tsv``), without what was answered or noted."""

    participant: str
    session: int
    number: int
    t_ns: int
    wall: str
    kind: str
    step: str
    section: int
    condition: str
    game: int
    attempt: int
    reason: str
    policy: str
    config: str
    schema: int = SCHEMA
    commit: str = ""


class NoteRow(msgspec.Struct, frozen=True, kw_only=True):
    """What the researcher wrote down in a session (``notes.csv``)."""

    participant: str
    session: int
    number: int
    """Of the event."""
    t_ns: int
    wall: str
    step: str
    section: int
    condition: str
    game: int
    text: str
    policy: str
    config: str
    schema: int = SCHEMA
    commit: str = ""
