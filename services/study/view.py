"""What the study's two pages show and ask for: whole views out as JSON, asks with an id in.

A view is everything that a page shows, so the newest replaces all before it. An ask carries an id
that the page makes up; the page repeats it, over reloads and lost connections, until a ``Reply``
with that id comes, and ``asks.Asks`` lets each id through once.
"""

from typing import Annotated, Literal

import msgspec

from shared.errors import MessageError
from shared.messages.play import GateMode, Phase

MAX_TEXT = 2000
"""Longest text that a person may write in one place (characters)."""
MAX_ANSWERS = 64
MAX_CHOICES = 64
"""Most options of one item, chosen or ranked."""
MAX_POINTS = 11
"""Of a scale."""
MAX_BYTES = 1 << 20
"""Longest ask; the bounds above keep within it, however a browser writes its characters."""

Screen = Literal[
    "welcome", "consent", "text", "countdown", "playing", "score", "rest", "questionnaire",
    "ranking", "waiting", "thanks",
]  # fmt: skip
Scale = Literal["points", "choices", "ranking", "open"]
Course = Literal["new", "running", "paused", "aborted", "ended"]
ResearcherAction = Literal[
    "begin", "next", "repeat", "void", "note", "pause", "resume", "abort", "arm", "disarm", "reset"
]
ParticipantAction = Literal["ready", "consent", "answers", "ranking"]


class StepView(msgspec.Struct, frozen=True, kw_only=True):
    """One step of the session, as the researcher sees it."""

    id: str
    """As ``s2-g03``."""
    kind: str
    title: str
    section: int = 0
    """Counts from 1, 0 where there is none; the game as well."""
    game: int = 0
    condition: str = ""
    """The blinded label."""
    seconds: float = 0.0
    """How long it takes, 0 where a person decides (s)."""
    is_recorded: bool = True


class BoutView(msgspec.Struct, frozen=True, kw_only=True):
    """The game that is on, or was last."""

    bout: str
    phase: Phase
    seconds: float
    """Game time (s)."""
    score: float
    attack_steps: int = 0
    penalty_steps: int = 0
    camping_steps: int = 0
    reason: str = ""
    """Why it is paused or void."""


class HeartView(msgspec.Struct, frozen=True, kw_only=True):
    """The heart-rate sensor."""

    beats_per_minute: float | None = None
    """None without a fresh measurement."""
    has_contact: bool = True
    source: str = ""
    recent: tuple[float | None, ...] = ()
    """One value a second, newest last, at most 120; None where there was none."""
    walking: float | None = None
    """Baselines, where they have been measured (1/min)."""
    seated: float | None = None


class TrackerView(msgspec.Struct, frozen=True, kw_only=True):
    """Whether the person's bat is seen."""

    is_tracked: bool
    lost_seconds: float = 0.0


class GateView(msgspec.Struct, frozen=True, kw_only=True):
    """The safety gate."""

    mode: GateMode | None = None
    """None while robot_io has not been heard."""
    reason: str = ""
    """Why it holds or has tripped."""
    in_the_way: tuple[str, ...] = ()
    """What stood in the way when somebody last asked to arm; empty once it is armed."""


class ServiceView(msgspec.Struct, frozen=True, kw_only=True):
    """A process that the study needs."""

    name: str
    is_alive: bool
    state: str = ""


class GameView(msgspec.Struct, frozen=True, kw_only=True):
    """One attempt at a game that is over."""

    step: str
    """Of the game; with ``attempt`` it names the row."""
    section: int
    game: int
    attempt: int
    outcome: Literal["finished", "void", "repeat"]
    is_recorded: bool
    score: float | None = None
    condition: str = ""
    """The blinded label."""
    reason: str = ""
    may: tuple[Literal["void", "repeat"], ...] = ()
    """What may be asked for about it."""


class NoteView(msgspec.Struct, frozen=True, kw_only=True):
    """A note of the researcher."""

    at: str
    """Local time of day, ``14:03:21``."""
    step: str
    text: str


class ResearcherView(msgspec.Struct, frozen=True, kw_only=True):
    """Everything on the researcher's page."""

    study: str
    """Its title."""
    participant: str
    course: Course
    steps: tuple[StepView, ...]
    """The whole session in order."""
    at: int
    """Index of the step that is on; ``len(steps)`` after the last one."""
    waiting_for: str = ""
    """What has to happen before it goes on, in words; empty while it goes on by itself."""
    seconds_left: float | None = None
    """Of the step's timer; None without one."""
    screen: Screen = "waiting"
    """What the participant sees."""
    is_participant_here: bool = False
    """Whether the participant's page is open."""
    bout: BoutView | None = None
    heart: HeartView = HeartView()
    tracker: TrackerView | None = None
    """None before it was heard."""
    gate: GateView = GateView()
    services: tuple[ServiceView, ...] = ()
    may: tuple[ResearcherAction, ...] = ()
    """What is accepted now; the page disables the rest."""
    games: tuple[GameView, ...] = ()
    notes: tuple[NoteView, ...] = ()
    warnings: tuple[str, ...] = ()
    """Shown loudly for as long as they are in the view."""


class Item(msgspec.Struct, frozen=True, kw_only=True):
    """One question of a questionnaire or ranking, as ``shared.study.protocol.Item`` has it."""

    id: str
    text: str
    scale: Scale
    points: int = 5
    """``points``: how many."""
    labels: tuple[str, ...] = ()
    """``points``: words for each of them; () for the page's own where there are five."""
    options: tuple[str, ...] = ()
    """``choices``: what can be chosen. ``ranking``: numbers of the sections to put in order."""
    is_several: bool = False
    """``choices``: more than one may be chosen."""
    other: str = ""
    """``choices``: the option that comes with a line to describe it; empty for none."""
    ends: tuple[str, str] = ("", "")
    """``ranking``: words for the least and the most; empty for the page's own."""
    is_required: bool = True


class ParticipantView(msgspec.Struct, frozen=True, kw_only=True):
    """Everything on the participant's page; never the name of a condition."""

    screen: Screen
    session: str = ""
    """Says nothing; another one for every session, and the same after a restart of the runner:
    what was typed in one session is not shown in the next."""
    step: str = ""
    """Its id; asks name it, so that none counts for another step."""
    title: str = ""
    text: str = ""
    """Of the protocol; an empty line parts paragraphs. Empty: the page has words of its own. For
    ``countdown``, ``score`` and ``rest`` the page has a title of its own, too."""
    statements: tuple[str, ...] = ()
    """``consent``: each has to be ticked; () for the page's own one."""
    items: tuple[Item, ...] = ()
    """``questionnaire`` and ``ranking``."""
    is_paged: bool = False
    """``questionnaire``: one question a screen rather than a list."""
    seconds_left: float | None = None
    seconds: float = 0.0
    """Length of what ``seconds_left`` counts down (s)."""
    score: float | None = None
    """``playing`` and ``score``; None where the protocol hides it."""
    section: int = 0
    sections: int = 0
    game: int = 0
    """Of ``games`` in this section, from 1; 0 outside games."""
    games: int = 0
    done: int = 0
    """Steps of the session that are behind, of ``total``."""
    total: int = 0
    is_recorded: bool = True
    """False: the game is a warm-up."""
    is_paused: bool = False
    may: tuple[ParticipantAction, ...] = ()
    """What is accepted now; without ``ready`` the screen has no button."""
    language: str = "en"
    """Of the page's own words: one that ``static/words.js`` has, else English."""


_Id = Annotated[str, msgspec.Meta(pattern=r"^[A-Za-z0-9\-]{1,64}\Z")]
_Name = Annotated[str, msgspec.Meta(max_length=400)]
_Text = Annotated[str, msgspec.Meta(max_length=MAX_TEXT)]
_Place = Annotated[int, msgspec.Meta(ge=1, le=MAX_CHOICES)]


class Answer(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The answer to one item; what does not belong to its scale stays empty."""

    item: _Name
    value: Annotated[int, msgspec.Meta(ge=1, le=MAX_POINTS)] | None = None
    """``points``: from 1, as the person chose; not turned round for a reversed item."""
    choices: Annotated[tuple[_Name, ...], msgspec.Meta(max_length=MAX_CHOICES)] = ()
    """``choices``: options that were chosen."""
    ranks: Annotated[tuple[_Place, ...], msgspec.Meta(max_length=MAX_CHOICES)] = ()
    """``ranking``: in the order of the options, 1 is the least; equal ones are a tie."""
    text: _Text = ""
    """``open``, or the description of ``other``."""


class ResearcherAsk(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A click on the researcher's page."""

    id: _Id
    action: ResearcherAction
    step: _Name = ""
    """``repeat``, ``void``: the game it is about. Otherwise the step that was on the page."""
    attempt: Annotated[int, msgspec.Meta(ge=0, le=1000)] = 0
    """Of that game; 0 is the one that is on."""
    reason: _Text = ""
    """``repeat``, ``void``, ``next``, ``abort``."""
    text: _Text = ""
    """``note``."""


class ParticipantAsk(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What a participant says."""

    id: _Id
    action: ParticipantAction
    step: _Name
    """The step that was on the page."""
    answers: Annotated[tuple[Answer, ...], msgspec.Meta(max_length=MAX_ANSWERS)] = ()
    """``answers`` and ``ranking``."""


class Reply(msgspec.Struct, frozen=True, kw_only=True):
    """What came of an ask."""

    id: str
    is_done: bool
    lines: tuple[str, ...] = ()
    """Why not; or what else there is to say."""


Ask = ResearcherAsk | ParticipantAsk
_RESEARCHER = msgspec.json.Decoder(ResearcherAsk)
_PARTICIPANT = msgspec.json.Decoder(ParticipantAsk)


def parse_researcher_ask(text: str | bytes) -> ResearcherAsk:
    """Return what one message of the researcher's page asks for.

    Raises:
        MessageError: it is no such ask; says why.
    """
    try:
        return _RESEARCHER.decode(text)
    except (ValueError, RecursionError) as error:
        raise MessageError(f"a researcher's ask cannot be read: {error}") from None


def parse_participant_ask(text: str | bytes) -> ParticipantAsk:
    """Return what one message of the participant's page says.

    Raises:
        MessageError: it is no such ask; says why.
    """
    try:
        return _PARTICIPANT.decode(text)
    except (ValueError, RecursionError) as error:
        raise MessageError(f"a participant's ask cannot be read: {error}") from None
