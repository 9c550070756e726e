"""The tables of a session, made of its journal: the journal is what happened, they are copies."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Final

from shared.errors import StudyError
from shared.study.events import (
    Answered,
    Event,
    GameEnded,
    GameStarted,
    Noted,
    Ranked,
    Repeated,
    SessionBegan,
    Voided,
)
from shared.study.folder import PARTICIPANTS, Study
from shared.study.instants import text_of
from shared.study.journal import FILE, read_journal
from shared.study.progress import Attempt, Progress, replay
from shared.study.protocol import Item, Protocol
from shared.study.rows import (
    EventRow,
    GameRow,
    NoteRow,
    ParticipantRow,
    QuestionnaireRow,
    RankingRow,
)
from shared.study.steps import Step, steps_of
from shared.study.tsv import write_table

EVENTS: Final = "events.tsv"
GAMES: Final = "games.tsv"
HEART_RATE: Final = "hr.tsv"
QUESTIONNAIRE: Final = "questionnaire.tsv"
RANKINGS: Final = "rankings.tsv"


class SessionRows:
    """All rows that the events of one session make."""

    def __init__(self, protocol: Protocol, steps: Sequence[Step], events: Sequence[Event]) -> None:
        """Take a session's events, of which the first is ``session_began``.

        Raises:
            StudyError: the events cannot follow each other, or are not of this protocol.
        """
        self._protocol = protocol
        self._steps = {step.id: step for step in steps}
        self._events = events
        self._progress = replay(events)
        began = self._progress.began
        assert began is not None
        self._began = began
        self._labels = began.order
        if len(self._labels) != len(protocol.section):
            raise StudyError(
                f"the journal of {began.participant} has {len(self._labels)} sections, the "
                f"protocol {len(protocol.section)}: put back the protocol it began with"
            )
        for event in events:
            self._check(event)
        self._settings = list(_settings(events))
        self._policies = _policies(self._progress, self._steps)

    def _check(self, event: Event) -> None:
        """Check that an event fits the protocol.

        Raises:
            StudyError: step, instrument or section are none of it.
        """
        what = event.what
        place = f"the journal of {self._began.participant}, event {event.number} ({event.kind})"
        needs_step = isinstance(what, GameStarted | GameEnded | Answered | Ranked)
        if needs_step and event.step not in self._steps:
            raise StudyError(f"{place}: {event.step[:80]!r} is no step of the protocol")
        if isinstance(what, Answered | Ranked):
            names = [instrument.name for instrument in self._protocol.instrument]
            if what.instrument not in names:
                raise StudyError(f"{place}: there is no instrument {what.instrument[:80]!r}")
        if isinstance(what, Ranked):
            sections = {section for ranks in what.ranks.values() for section in ranks}
            if not sections <= set(range(1, len(self._labels) + 1)):
                raise StudyError(f"{place}: it ranks sections that are none: {sorted(sections)}")

    def label(self, section: int) -> str:
        """Return the label of the condition of a section; empty for section 0."""
        return self._labels[section - 1] if section else ""

    def participant(self) -> ParticipantRow:
        """Return the row of the session."""
        progress, began = self._progress, self._began
        first, last = self._events[0], self._events[-1]
        counted = [
            step for step in self._steps.values()
            if step.kind == "game" and progress.finished(step.id) is not None
        ]  # fmt: skip
        return ParticipantRow(
            participant=began.participant, session=began.session, order=",".join(began.order),
            state=progress.state, games=len(counted), t_ns=first.t_ns,
            wall=text_of(first.wall_ns), wall_ended=text_of(last.wall_ns),
            protocol=began.protocol, config=progress.config, version=began.version,
            commit=progress.commit,
        )  # fmt: skip

    def games(self) -> list[GameRow]:
        """Return a row for every attempt at a game, in the order in which they started."""
        found = [
            (attempt, self._steps[step])
            for step, attempts in self._progress.games.items() if step in self._steps
            for attempt in attempts
        ]  # fmt: skip
        found.sort(key=lambda pair: pair[0].started.number)
        return [self._game(attempt, step) for attempt, step in found]

    def questionnaire(self) -> list[QuestionnaireRow]:
        """Return the rows of all answers, in the order of the steps."""
        rows: list[QuestionnaireRow] = []
        for event in self._latest("answers"):
            answered = self._progress.answers[event.step]
            instrument = self._protocol.instrument_named(answered.instrument)
            for item in instrument.item:
                rows += self._answer(event, instrument.name, item)
        return rows

    def rankings(self) -> list[RankingRow]:
        """Return the rows of all rankings, in the order of the steps."""
        return [
            RankingRow(
                participant=self._began.participant, session=self._began.session,
                after=self._steps[event.step].section or len(self._labels),
                instrument=ranked.instrument, question=question, section=section,
                condition=self.label(section), rank=rank, t_ns=event.t_ns,
                wall=text_of(event.wall_ns), policy=self._policies.get(section, ""),
                config=self._config(event),
            )
            for event in self._latest("ranking")
            for ranked in [self._progress.rankings[event.step]]
            for question, ranks in ranked.ranks.items()
            for section, rank in sorted(ranks.items())
        ]  # fmt: skip

    def events(self) -> list[EventRow]:
        """Return a row for every event."""
        return [self._event(event) for event in self._events]

    def notes(self) -> list[NoteRow]:
        """Return the rows of all notes."""
        rows = zip(self._events, self.events(), strict=True)
        return [
            NoteRow(
                participant=row.participant, session=row.session, number=row.number, t_ns=row.t_ns,
                wall=row.wall, step=row.step, section=row.section, condition=row.condition,
                game=row.game, text=event.what.text, policy=row.policy, config=row.config,
                commit=row.commit,
            )
            for event, row in rows if isinstance(event.what, Noted)
        ]  # fmt: skip

    def _game(self, attempt: Attempt, step: Step) -> GameRow:
        start, end, event = attempt.start, attempt.end, attempt.started
        return GameRow(
            participant=self._began.participant, session=self._began.session,
            section=step.section, condition=self.label(step.section), game=step.game,
            attempt=attempt.number, outcome=attempt.outcome, is_recorded=step.is_recorded,
            score=end.score if end else None, attack_steps=end.attack_steps if end else None,
            penalty_steps=end.penalty_steps if end else None,
            camping_steps=end.camping_steps if end else None, steps=end.steps if end else None,
            seconds=end.seconds if end else None, reason=attempt.reason, t_ns=event.t_ns,
            wall=text_of(event.wall_ns), bout=start.bout, policy=start.policy,
            config=self._config(event), commit=self._commit(event),
        )  # fmt: skip

    def _answer(self, event: Event, instrument: str, item: Item) -> Iterator[QuestionnaireRow]:
        given = self._progress.answers[event.step].answers.get(item.id)
        step = self._steps[event.step]
        values: list[tuple[int | None, str]] = [(given.value if given else None, "")]
        if given is not None and given.chosen:
            numbers = {option: index for index, option in enumerate(item.options, start=1)}
            values = [(numbers.get(option), option) for option in given.chosen]
        for value, option in values:
            is_own = given is not None and (not option or option == item.other)
            yield QuestionnaireRow(
                participant=self._began.participant, session=self._began.session,
                section=step.section, condition=self.label(step.section), step=step.id,
                instrument=instrument, item=item.id, construct=item.construct,
                reversed=item.is_reversed, value=value, option=option,
                text=given.text if given is not None and is_own else "", t_ns=event.t_ns,
                wall=text_of(event.wall_ns), policy=self._policies.get(step.section, ""),
                config=self._config(event),
            )  # fmt: skip

    def _event(self, event: Event) -> EventRow:
        step = self._steps.get(event.step)
        section = step.section if step else 0
        what = event.what
        is_game = isinstance(what, GameStarted | GameEnded)
        return EventRow(
            participant=self._began.participant, session=self._began.session,
            number=event.number, t_ns=event.t_ns, wall=text_of(event.wall_ns), kind=event.kind,
            step=event.step, section=section, condition=self.label(section),
            game=step.game if step else 0,
            attempt=what.attempt if is_game or isinstance(what, Voided | Repeated) else 0,
            reason=getattr(what, "reason", ""),
            policy=what.policy if is_game else self._policies.get(section, ""),
            config=self._config(event), commit=self._commit(event),
        )  # fmt: skip

    def _latest(self, kind: str) -> list[Event]:
        """Return the last event of a kind for each step, in the order of the steps."""
        found = {event.step: event for event in self._events if event.kind == kind}
        return [found[step] for step in self._steps if step in found]

    def _config(self, event: Event) -> str:
        return self._settings[event.number - 1][0]

    def _commit(self, event: Event) -> str:
        return self._settings[event.number - 1][1]


def rows_of(study: Study, participant: str, session: int = 1) -> SessionRows | None:
    """Return the rows of a session; None where it has not begun.

    Raises:
        StudyError: the journal is damaged or another's, or nobody of that name is expected.
    """
    folder = study.session_folder(participant, session)
    events = read_journal(folder)
    if not events:
        return None
    began = events[0].what
    assert isinstance(began, SessionBegan)
    expected = (participant, session, study.labels_of(participant))
    if (began.participant, began.session, began.order) != expected:
        raise StudyError(
            f"{folder / FILE} is of {began.participant}, session {began.session}, order "
            f"{','.join(began.order)}; expected {participant}, session {session}, order "
            f"{','.join(expected[2])} (allocation.tsv): put back what was there"
        )
    # In any order: rows hold none of what an order tells of a step, and an analysis has no key.
    steps = steps_of(study.protocol, [each.name for each in study.protocol.condition])
    return SessionRows(study.protocol, steps, events)


def write_session(study: Study, participant: str, session: int = 1) -> None:
    """Write the tables of a session from its journal; heart rate is written as it comes.

    Raises:
        StudyError: the journal is damaged.
        RiposteError: there is no space; what was written before is intact.
    """
    rows = rows_of(study, participant, session)
    if rows is None:
        return
    folder = study.session_folder(participant, session)
    write_table(folder / GAMES, rows.games(), GameRow)
    write_table(folder / QUESTIONNAIRE, rows.questionnaire(), QuestionnaireRow)
    write_table(folder / RANKINGS, rows.rankings(), RankingRow)
    write_table(folder / EVENTS, rows.events(), EventRow)


def write_participants(study: Study) -> None:
    """Write ``participants.tsv`` from all journals.

    Raises:
        StudyError: a journal is damaged.
        RiposteError: there is no space; the file is as it was.
    """
    found = [rows_of(study, participant, number) for participant, number, _ in study.sessions()]
    rows = [each.participant() for each in found if each is not None]
    write_table(study.folder / PARTICIPANTS, rows, ParticipantRow)


def refresh(study: Study) -> None:
    """Write all tables again, as whoever was killed may not have come to it.

    Raises:
        StudyError: a journal is damaged.
        RiposteError: there is no space.
    """
    for participant, number, _ in study.sessions():
        write_session(study, participant, number)
    write_participants(study)


def bout_folder(session: Path, bout: str) -> Path:
    """Return the folder of a bout's archive."""
    return session / "bouts" / bout


def _settings(events: Sequence[Event]) -> Iterator[tuple[str, str]]:
    """Yield the settings' hash and the commit that held at each event."""
    config = commit = ""
    for event in events:
        config = getattr(event.what, "config", config)
        commit = getattr(event.what, "commit", commit)
        yield config, commit


def _policies(progress: Progress, steps: dict[str, Step]) -> dict[int, str]:
    """Return the player reference that was met last in each section."""
    return {
        steps[step].section: attempts[-1].start.policy
        for step, attempts in progress.games.items()
        if step in steps and steps[step].section
    }
