"""The study's work: bus and pages in, the next step of the session out, without waiting for either.

In one process with others, on the bus in memory and with a clock that is moved, a ``Study`` is
made without a window; its asks come through the same `Asks` that a page's do.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Protocol

import structlog

from services.study.answering import Answering, replies_of
from services.study.asks import Asks
from services.study.course import Terms
from services.study.errands import Errands
from services.study.hearing import Hearing
from services.study.heart import HeartLog
from services.study.lsl import Outlet
from services.study.plan import SessionPlan
from services.study.session import Session
from services.study.showing import (
    course_of,
    participant_view,
    researcher_view,
)
from services.study.view import ParticipantView, Reply, ResearcherView
from shared.bus.base import Bus
from shared.clock import Clock
from shared.runtime.service import Health
from shared.study.events import Event, SessionEnded, StepDone, Voided
from shared.study.journal import Journal
from shared.study.recorded import HEART_RATE
from shared.study.rows import HeartRateRow
from shared.study.tsv import RowLog

VIEW_PERIOD = 0.1
"""From one view to the next (s)."""
TAKE_MOST = 16
"""Asks taken in one tick."""
STILL_GAMES = ("starting", "playing", "countdown")
"""Stages in which no tables are written."""

log = structlog.get_logger()


class Window(Protocol):
    """The pages' side; ``Web`` is the real one."""

    @property
    def is_participant_here(self) -> bool:
        """Return whether a participant's page is open."""
        ...

    @property
    def counters(self) -> dict[str, int]:
        """Return counts since the start."""
        ...

    @property
    def last_refusal(self) -> str:
        """Return why a page or a message was refused last."""
        ...

    def show(self, researcher: ResearcherView, participant: ParticipantView) -> None:
        """Show new views."""
        ...

    def close(self) -> None:
        """Send the pages away."""
        ...


class Study:
    """One participant's session; a service that ticks."""

    def __init__(
        self, plan: SessionPlan, folder: Path, terms: Terms, journal: Journal, asks: Asks,
        window: Window | None, write_tables: Callable[[], None], bus: Bus, clock: Clock,
        outlet: Outlet | None = None,
    ) -> None:  # fmt: skip
        """Join the bus, and go on where the journal ends.

        Args:
            plan: of the session.
            folder: of the session; ``hr.tsv`` is in it.
            terms: what does not change in it.
            journal: of the session; it is closed with this.
            asks: what people ask for; ``asks_of`` makes one that knows those done already.
            window: the pages, None where there are none; it is closed with this.
            write_tables: makes the session's tables from its journal.
            bus: this process's end of the bus.
            clock: a clock that moves by itself, or is moved.
            outlet: is told of events and heart rate, where somebody records them elsewhere.

        Raises:
            StudyError: the journal is none of this plan's.
            RiposteError: a file cannot be written.
        """
        self.folder = folder
        """Of the session."""
        self._plan = plan
        self._journal = journal
        self._asks = asks
        self._window = window
        self._write_tables = write_tables
        self._clock = clock
        self._hearing = Hearing(bus, clock)
        self.session = Session(plan, journal, Errands(bus), clock, terms)
        self._answering = Answering(self.session)
        self._heart = HeartLog(plan, RowLog(folder / HEART_RATE, HeartRateRow), clock)
        self._outlet = outlet
        self._told = len(self.session.events)
        """Events that the outlet knows, or that were before it."""
        self._shown_at = -1e9
        self._tabled = 0
        """Events that the tables hold."""
        self._waited_at = clock.now()
        self._counters = {"asks_done": 0, "asks_refused": 0}

    def tick(self) -> bool:
        """Do what is due; return whether anything was done.

        Raises:
            RiposteError: a file cannot be written; what was said to be done is on the disk.
        """
        heard = self._hearing.listen()
        session = self.session
        self._heart.add(heard.beats, session.step, session.progress, heard.beats_per_minute)
        if self._outlet is not None and session.progress.has_consent:
            self._outlet.beats(heard.beats)
        did = session.tick(heard)
        for _ in range(TAKE_MOST):
            if (ask := self._asks.take()) is None:
                break
            did = True
            if (reply := self._answering.answer(ask)) is not None:
                self._tell(reply)
        for reply in self._answering.tick():
            did = True
            self._tell(reply)
        if self._outlet is not None:
            for event in session.events[self._told :]:
                self._outlet.event(event)
            self._told = len(session.events)
        self._keep_tables()
        self._show()
        if not session.waits_for:
            self._waited_at = self._clock.now()
        return did

    def health(self) -> Health:
        """Return where the session stands, and whom it waits for."""
        session = self.session
        step, steps = session.step, self._plan.steps
        words = f"{step.id} {session.moment.stage}" if step is not None else course_of(session)
        done = sum(each.id in session.progress.done for each in steps)
        window = self._window
        return Health(
            state=f"{self._plan.participant}: {words}, {done} of {len(steps)} steps done",
            waiting_for=session.waits_for,
            waiting_seconds=self._clock.now() - self._waited_at if session.waits_for else 0.0,
            counters={
                "events": len(session.events), "is_over": int(session.is_over),
                "heart_rate_rows": self._heart.rows,
                **self._counters, **(window.counters if window is not None else {}),
            },
            last_error=session.moment.trouble or (window.last_refusal if window else ""),
        )  # fmt: skip

    def close(self) -> None:
        """Write the tables and let go of everything; the session can go on later."""
        self._hearing.close()
        self._heart.close()
        try:
            if self._tabled < len(self.session.events):
                self._write_tables()
        finally:
            self._journal.close()
            if self._window is not None:
                self._window.close()

    def _tell(self, reply: Reply) -> None:
        self._counters["asks_done" if reply.is_done else "asks_refused"] += 1
        self._asks.answer(reply)

    def _keep_tables(self) -> None:
        """Write the tables after a step, not while somebody plays."""
        events = self.session.events
        if len(events) == self._tabled or self.session.moment.stage in STILL_GAMES:
            return
        if any(_ends_something(event) for event in events[self._tabled :]):
            self._write_tables()
            self._tabled = len(events)

    def _show(self) -> None:
        now = self._clock.now()
        if self._window is None or now - self._shown_at < VIEW_PERIOD:
            return
        self._shown_at = now
        self._window.show(
            researcher_view(
                self.session, self._answering, now=now, recent=tuple(self._heart.recent),
                services=self._hearing.services(), warnings=self._warnings(),
                is_participant_here=self._window.is_participant_here,
            ),
            participant_view(self.session, self._answering, now=now),
        )  # fmt: skip

    def _warnings(self) -> tuple[str, ...]:
        """Return what the researcher should know at once."""
        session = self.session
        warnings = [
            f"{step.id}: no heart rate was measured, the baseline is missing"
            for step in self._plan.steps
            if step.kind == "baseline" and step.id in session.progress.done
            and not ((found := session.progress.baselines.get(step.id)) and found.beats)
        ]  # fmt: skip
        if session.moment.trouble:
            warnings.append(session.moment.trouble)
        heart = session.heard.heart
        if heart is not None and not heart.contact:
            warnings.append("the heart-rate sensor does not touch the skin")
        return tuple(warnings)


def asks_of(journal: Journal) -> Asks:
    """Return a queue of asks that knows those whose events are in the journal."""
    return Asks(replies_of(journal.events))


def _ends_something(event: Event) -> bool:
    return isinstance(event.what, StepDone | SessionEnded | Voided)
