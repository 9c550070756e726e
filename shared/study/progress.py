"""Where a session stands: what its events say, and nothing else."""

from collections.abc import Iterable, Sequence
from typing import Literal

import msgspec

from shared.errors import StudyError
from shared.study.events import (
    Aborted,
    Answered,
    Consented,
    Event,
    GameEnded,
    GameStarted,
    Measured,
    Noted,
    Outcome,
    Paused,
    Ranked,
    Repeated,
    SessionBegan,
    SessionEnded,
    SessionResumed,
    StepBegan,
    StepDone,
    Unpaused,
    Voided,
)
from shared.study.steps import GAME_KINDS, Step

State = Literal["new", "going", "ended", "aborted"]


class Attempt(msgspec.Struct, frozen=True, kw_only=True):
    """One bout of one game step."""

    number: int
    started: Event
    ended: Event | None = None
    outcome: Outcome | Literal["running"] = "running"
    """As it stands now: a finished game may be made void, or be repeated, later."""
    reason: str = ""

    @property
    def start(self) -> GameStarted:
        """Return how it started."""
        assert isinstance(self.started.what, GameStarted)
        return self.started.what

    @property
    def end(self) -> GameEnded | None:
        """Return how it ended, None while it runs."""
        if self.ended is None:
            return None
        assert isinstance(self.ended.what, GameEnded)
        return self.ended.what


class Progress(msgspec.Struct, kw_only=True):
    """Where a session stands after its events."""

    state: State = "new"
    began: SessionBegan | None = None
    config: str = ""
    """SHA-256 of the settings, as of the latest begin or resumption."""
    commit: str = ""
    done: set[str] = msgspec.field(default_factory=set[str])
    """Ids of the steps that are over."""
    begun: str = ""
    """The step that has begun and is not over; empty where none is."""
    has_consent: bool = False
    is_paused: bool = False
    games: dict[str, list[Attempt]] = msgspec.field(default_factory=dict[str, list[Attempt]])
    """Attempts by id of their step."""
    baselines: dict[str, Measured] = msgspec.field(default_factory=dict[str, Measured])
    """By id of the step; the latest."""
    answers: dict[str, Answered] = msgspec.field(default_factory=dict[str, Answered])
    """By id of the step; the latest."""
    rankings: dict[str, Ranked] = msgspec.field(default_factory=dict[str, Ranked])
    notes: list[Event] = msgspec.field(default_factory=list[Event])
    last: Event | None = None

    @property
    def running(self) -> tuple[str, Attempt] | None:
        """Return the step and the attempt of the game that has started and not ended."""
        for step, attempts in self.games.items():
            if attempts[-1].outcome == "running":
                return step, attempts[-1]
        return None

    def current(self, steps: Sequence[Step]) -> Step | None:
        """Return the step to be done: the first that is not over; None where all are."""
        return next((step for step in steps if step.id not in self.done), None)

    def next_attempt(self, step: str) -> int:
        """Return the number that the next bout of a game step has."""
        return len(self.games.get(step, ())) + 1

    def finished(self, step: str) -> Attempt | None:
        """Return the attempt of a game step that counts, None where none does."""
        found = [each for each in self.games.get(step, ()) if each.outcome == "finished"]
        return found[-1] if found else None


def replay(events: Iterable[Event]) -> Progress:
    """Return where a session stands after its events.

    Raises:
        StudyError: an event cannot follow those before it; says which.
    """
    progress = Progress()
    for event in events:
        follow(progress, event)
    return progress


def follow(progress: Progress, event: Event) -> None:
    """Carry a session's progress on by its next event.

    Raises:
        StudyError: the event cannot follow those before it.
    """
    what, step = event.what, event.step
    if progress.state in ("ended", "aborted") and not isinstance(
        what, SessionResumed | Noted | Voided
    ):
        raise _impossible(event, f"the session is over ({progress.state})")
    match what:
        case SessionBegan() | SessionResumed():
            _opened(progress, what)
        case StepBegan():
            progress.begun = step
        case StepDone():
            progress.done.add(step)
            progress.begun = "" if progress.begun == step else progress.begun
        case Consented():
            progress.has_consent = True
        case Measured():
            progress.baselines[step] = what
        case GameStarted() | GameEnded():
            _played(progress, event)
        case Voided() | Repeated():
            _taken_out(progress, event, what)
        case Answered():
            progress.answers[step] = what
        case Ranked():
            progress.rankings[step] = what
        case Noted():
            progress.notes.append(event)
        case Paused() | Unpaused():
            progress.is_paused = isinstance(what, Paused)
        case Aborted():
            progress.state = "aborted"
        case SessionEnded():
            progress.state = "ended"
    progress.last = event


def is_game(step: Step) -> bool:
    """Return whether a bout is played in a step."""
    return step.kind in GAME_KINDS


def _opened(progress: Progress, what: SessionBegan | SessionResumed) -> None:
    if isinstance(what, SessionBegan):
        progress.began = what
    if progress.state in ("new", "aborted"):  # who aborted by mistake resumes
        progress.state = "going"
    progress.config, progress.commit = what.config, what.commit


def _played(progress: Progress, event: Event) -> None:
    what = event.what
    attempts = progress.games.get(event.step, [])
    if isinstance(what, GameStarted):
        if progress.running is not None:
            raise _impossible(event, f"the game of {progress.running[0]} has not ended")
        if what.attempt != len(attempts) + 1:
            raise _impossible(event, f"attempt {what.attempt} follows attempt {len(attempts)}")
        progress.games[event.step] = [*attempts, Attempt(number=what.attempt, started=event)]
        return
    assert isinstance(what, GameEnded)
    if not attempts or attempts[-1].outcome != "running" or attempts[-1].number != what.attempt:
        raise _impossible(event, f"attempt {what.attempt} of {event.step} is not running")
    attempts[-1] = msgspec.structs.replace(
        attempts[-1], ended=event, outcome=what.outcome, reason=what.reason
    )


def _taken_out(progress: Progress, event: Event, what: Voided | Repeated) -> None:
    attempts = progress.games.get(event.step, [])
    if not 1 <= what.attempt <= len(attempts) or attempts[what.attempt - 1].ended is None:
        raise _impossible(event, f"attempt {what.attempt} of {event.step} has not ended")
    is_repeated = isinstance(what, Repeated)
    attempts[what.attempt - 1] = msgspec.structs.replace(
        attempts[what.attempt - 1],
        outcome="repeat" if is_repeated else "void",
        reason=what.reason,
    )
    if is_repeated:
        progress.done.discard(event.step)


def _impossible(event: Event, reason: str) -> StudyError:
    return StudyError(f"journal, event {event.number} ({event.kind}): {reason}")
