"""What the people at the two pages ask for: done, or refused with the reason, once for each id."""

from collections.abc import Callable

import structlog
from msgspec.structs import replace

from services.study.course import FORMS, MOVING, missing
from services.study.errands import GateAction
from services.study.forms import items_of, lacks_of
from services.study.session import Session, game_ended
from services.study.view import (
    Ask,
    ParticipantAction,
    ParticipantAsk,
    Reply,
    ResearcherAction,
    ResearcherAsk,
)
from shared.study.events import (
    Aborted,
    Answer,
    Answered,
    Consented,
    Event,
    Noted,
    Paused,
    Ranked,
    Repeated,
    Unpaused,
    Voided,
)
from shared.study.progress import Attempt
from shared.study.steps import Step

READY: tuple[str, ...] = ("instruction", "debrief")
"""Kinds of steps that a participant ends by saying ready."""
GATE: tuple[ResearcherAction, ...] = ("arm", "disarm", "reset")

log = structlog.get_logger()


class Answering:
    """Does what is asked for; answers of the gate and of the referee come later."""

    def __init__(self, session: Session) -> None:
        """Take the session over which the asks are."""
        self._session = session
        self._overtaken: list[Reply] = []
        self._gate_ask: tuple[GateAction, str] | None = None
        """Action and id of what the gate was asked for."""
        self.in_the_way: tuple[str, ...] = ()
        """What the gate said last of why it cannot be armed."""

    def answer(self, ask: Ask) -> Reply | None:
        """Do what is asked for; return what came of it, None where that comes later.

        Raises:
            RiposteError: the journal cannot be written.
        """
        if isinstance(ask, ParticipantAsk):
            return self._participant(ask)
        return self._researcher(ask)

    def tick(self) -> list[Reply]:
        """Return the answers that have come; a robot of a session that is over is disarmed."""
        replies = [Reply(id=id, is_done=True) for id in self._session.ended_asks]
        self._session.ended_asks.clear()
        replies += self._overtaken
        self._overtaken.clear()
        if self._session.is_over and self._session.heard.mode in MOVING and self._gate_ask is None:
            self._ask_gate("disarm", "over")
        if self._gate_ask is None or (answered := self._session.errands.take_gate()) is None:
            return replies
        (action, id), self._gate_ask = self._gate_ask, None
        if action == "check":
            is_moving = answered.mode in MOVING
            self.in_the_way = () if is_moving else answered.lines
            return [*replies, self._begin_session(id, self.in_the_way)]
        if action == "arm":
            self.in_the_way = () if answered.is_accepted else answered.lines
        return [*replies, Reply(id=id, is_done=answered.is_accepted, lines=answered.lines)]

    # -- what may be asked for -----------------------------------------------------------------

    def may_researcher(self) -> tuple[ResearcherAction, ...]:
        """Return what a researcher may ask for now."""
        session = self._session
        state = session.progress.state
        if state in ("ended", "aborted"):
            return ("note", "disarm", "void")
        if state == "new":
            return ("begin", *GATE)
        turn: ResearcherAction = "resume" if session.progress.is_paused else "pause"
        may: list[ResearcherAction] = ["note", "abort", "arm", "disarm", "reset", turn]
        step, stage = session.step, session.moment.stage
        if step is not None and not session.progress.is_paused:
            if stage == "idle" and not session.moment.is_asked:
                may.append("begin")
            if self._why_not_next(step) == "":
                may.append("next")
        return (*may, "void", "repeat")

    def may_participant(self) -> tuple[ParticipantAction, ...]:
        """Return what a participant may say now."""
        session = self._session
        step = session.step
        if step is None or session.moment.stage != "form":
            return ()
        if step.kind == "consent":
            return ("consent",)
        if step.kind in READY:
            return ("ready",)
        return ("ranking",) if step.kind == "ranking" else ("answers",)

    def may_of(self, step: Step, attempt: Attempt) -> tuple[ResearcherAction, ...]:
        """Return what may be asked for about one attempt at a game."""
        if attempt.outcome == "running":
            return ("void", "repeat")
        if attempt.outcome != "finished":
            return ()
        may_repeat = not self._why_not_repeat(step)
        return ("void", "repeat") if may_repeat else ("void",)

    def _why_not_next(self, step: Step) -> str:
        session = self._session
        if step.kind == "consent":
            return "nobody but the participant can consent: abort the session instead"
        if session.progress.running is not None:
            return "a game is on: void or repeat it"
        return ""

    def _why_not_repeat(self, step: Step) -> str:
        session = self._session
        if session.progress.state != "going":
            return "the session is over"
        if session.progress.running is not None:
            return "a game is on"
        section = max(
            (each.section for each in session.plan.steps if each.id in session.progress.games),
            default=0,
        )
        if step.section != section:
            return f"section {section} has begun: games of earlier ones are not played again"
        return ""

    # -- the researcher ------------------------------------------------------------------------

    def _researcher(self, ask: ResearcherAsk) -> Reply | None:
        does: dict[ResearcherAction, Callable[[ResearcherAsk], Reply | None]] = {
            "begin": self._begin,
            "next": self._next,
            "repeat": self._take_out,
            "void": self._take_out,
            "note": self._note,
            "pause": self._pause,
            "resume": self._resume,
            "abort": self._abort,
            "arm": self._gate,
            "disarm": self._gate,
            "reset": self._gate,
        }
        if ask.action not in self.may_researcher():
            return _no(ask, f"{ask.action} is not possible now")
        return does[ask.action](ask)

    def _begin(self, ask: ResearcherAsk) -> Reply | None:
        session = self._session
        if session.progress.state == "new":
            lacks = missing(session.heard, needs_recorder=session.terms.needs_recorder)
            if lacks:
                return _no(ask, *(f"waiting for {lack}" for lack in lacks))
            return self._ask_gate("check", ask.id)
        if (step := session.step) is None or step.id != ask.step:
            return _no(ask, "the step is another one by now")
        session.moment = replace(session.moment, is_asked=True)
        return _yes(ask)

    def _begin_session(self, id: str, reasons: tuple[str, ...]) -> Reply:
        if reasons:
            return Reply(id=id, is_done=False, lines=reasons)
        if self._session.progress.state == "new":
            self._session.write(self._session.plan.began, ask=id)
        return Reply(id=id, is_done=True)

    def _next(self, ask: ResearcherAsk) -> Reply | None:
        session = self._session
        step = session.step
        if step is None or step.id != ask.step:
            return _no(ask, "the step is another one by now")
        if why := self._why_not_next(step):
            return _no(ask, why)
        reason = ask.reason or "ended by the researcher"
        if session.moment.stage in ("starting", "playing"):  # an exploration
            session.doom("void", reason, ask.id)
            return None
        session.finish(step, "" if session.moment.stage == "score" else reason, ask.id)
        return _yes(ask)

    def _take_out(self, ask: ResearcherAsk) -> Reply | None:
        session = self._session
        if not ask.reason.strip():
            return _no(ask, f"say why the game is to be {ask.action}ed")
        running = session.progress.running
        if running is not None and ask.step == running[0] and ask.attempt in (0, running[1].number):
            if session.ending is not None:
                return _no(ask, "the game is being ended already")
            session.doom("repeat" if ask.action == "repeat" else "void", ask.reason, ask.id)
            return None
        attempts = session.progress.games.get(ask.step, [])
        step = next((each for each in session.plan.steps if each.id == ask.step), None)
        if step is None or not 1 <= ask.attempt <= len(attempts):
            return _no(ask, f"there is no attempt {ask.attempt} at {ask.step[:40]!r}")
        if ask.action not in self.may_of(step, attempts[ask.attempt - 1]):
            why = self._why_not_repeat(step) if ask.action == "repeat" else ""
            return _no(ask, why or f"it is {attempts[ask.attempt - 1].outcome} already")
        if ask.action == "void":
            session.write(Voided(attempt=ask.attempt, reason=ask.reason), step.id, ask.id)
        else:
            session.write(Repeated(attempt=ask.attempt, reason=ask.reason), step.id, ask.id)
            session.start_over(f"attempt {ask.attempt} is repeated: {ask.reason}")
        return _yes(ask)

    def _note(self, ask: ResearcherAsk) -> Reply:
        if not ask.text.strip():
            return _no(ask, "the note is empty")
        step = self._session.step
        self._session.write(Noted(text=ask.text), step.id if step is not None else "", ask.id)
        return _yes(ask)

    def _pause(self, ask: ResearcherAsk) -> Reply:
        session = self._session
        step = session.step
        session.write(Paused(reason=ask.reason), step.id if step is not None else "", ask.id)
        moment = session.moment
        if moment.stage == "countdown":
            moment = replace(moment, stage="ready", loaded="")
        if step is not None and step.kind == "baseline" and moment.stage == "timer":
            session.start_over("it was paused, and is measured anew")
            moment = session.moment
        session.moment = replace(moment, is_paused=True)
        return _yes(ask)

    def _resume(self, ask: ResearcherAsk) -> Reply:
        session = self._session
        step = session.step
        session.write(Unpaused(), step.id if step is not None else "", ask.id)
        session.moment = replace(session.moment, is_paused=False)
        return _yes(ask)

    def _abort(self, ask: ResearcherAsk) -> Reply:
        session = self._session
        if not ask.reason.strip():
            return _no(ask, "say why the session is to be aborted")
        step = session.step
        if session.progress.running is not None and step is not None:
            said = session.heard.referee if session.is_bout_on else None
            why = f"the session was aborted: {ask.reason}"
            session.write(game_ended(session, step, "void", why, said), step.id)
        session.ending = None
        session.write(Aborted(reason=ask.reason), ask=ask.id)
        session.start_over()
        self._ask_gate("disarm", f"{ask.id}-disarm")  # the game that is on is abandoned, too
        return _yes(ask)

    def _gate(self, ask: ResearcherAsk) -> Reply | None:
        assert ask.action in ("arm", "disarm", "reset")
        return self._ask_gate(ask.action, ask.id)

    def _ask_gate(self, action: GateAction, id: str) -> Reply | None:
        """Ask the gate; to disarm waits for no earlier answer."""
        if self._gate_ask is not None:
            if action != "disarm":
                return Reply(id=id, is_done=False, lines=("robot_io has not answered yet",))
            earlier = Reply(id=self._gate_ask[1], is_done=False, lines=("disarmed meanwhile",))
            self._overtaken.append(earlier)
        self._gate_ask = (action, id)
        self._session.errands.gate(action)
        return None

    # -- the participant -----------------------------------------------------------------------

    def _participant(self, ask: ParticipantAsk) -> Reply:
        session = self._session
        step = session.step
        if step is None or step.id != ask.step:
            return _no(ask, "this page is over")
        if ask.action not in self.may_participant():
            return _no(ask, f"{ask.action} is not asked for now")
        assert step.kind in FORMS
        if ask.action == "consent":
            statements = session.plan.protocol.consent.statements
            session.write(Consented(statements=statements), step.id, ask.id)
        elif ask.action != "ready" and (lacks := self._fill_in(step, ask)):
            return _no(ask, *lacks)
        session.finish(step, ask=ask.id if ask.action == "ready" else "")
        return _yes(ask)

    def _fill_in(self, step: Step, ask: ParticipantAsk) -> list[str]:
        """Write the answers down, or return what is wrong with them."""
        session = self._session
        instrument = session.plan.protocol.instrument_named(step.instrument)
        sections = sections_to_rank(session)
        items = items_of(instrument, sections)
        if lacks := lacks_of(items, ask.answers):
            return lacks
        if ask.action == "ranking":
            ranks = {
                answer.item: dict(zip(sections, answer.ranks, strict=True))
                for answer in ask.answers if answer.ranks
            }  # fmt: skip
            session.write(Ranked(instrument=step.instrument, ranks=ranks), step.id, ask.id)
            return []
        answers = {
            answer.item: Answer(value=answer.value, chosen=answer.choices, text=answer.text)
            for answer in ask.answers
        }
        session.write(Answered(instrument=step.instrument, answers=answers), step.id, ask.id)
        return []


def sections_to_rank(session: Session) -> list[int]:
    """Return the numbers of the sections in which a game counts, in order."""
    steps = session.plan.steps
    return sorted({s.section for s in steps if s.section and session.progress.finished(s.id)})


def replies_of(events: tuple[Event, ...]) -> list[Reply]:
    """Return what was answered to asks whose events are in a journal."""
    return [Reply(id=event.ask, is_done=True) for event in events if event.ask]


def _yes(ask: Ask) -> Reply:
    return Reply(id=ask.id, is_done=True)


def _no(ask: Ask, *lines: str) -> Reply:
    log.info("ask_refused", action=ask.action, reasons=list(lines))
    return Reply(id=ask.id, is_done=False, lines=lines)
