"""The two people at the pages, simulated: who answers, and who arms and begins.

They say what the pages would say, by the same asks, and only what may be said at that time.
"""

from typing import Final

import numpy as np

from services.study.answering import Answering, sections_to_rank
from services.study.asks import Asks
from services.study.course import PLAYED
from services.study.session import UNMEASURED, Session
from services.study.view import (
    Answer,
    ParticipantAction,
    ParticipantAsk,
    ResearcherAction,
    ResearcherAsk,
)
from shared.clock import Clock
from shared.study.people import attitudes
from shared.study.people.population import Traits
from shared.study.protocol import Item
from shared.study.steps import Step

LOOK_SECONDS: Final = 0.5
"""From one look at the page to the next (s)."""
READING_SECONDS: Final = 4.0
"""On a page before its button is pressed (s)."""
SHUT: Final = ("disarmed", "tripped")


class Desk:
    """Presses the buttons of both pages."""

    def __init__(
        self, session: Session, answering: Answering, asks: Asks, traits: Traits, seed: int,
        clock: Clock,
    ) -> None:  # fmt: skip
        """Sit down at both.

        Args:
            session: what both pages show.
            answering: what may be asked for now.
            asks: where the pages put what they ask for.
            traits: of the participant.
            seed: of the study.
            clock: times looks at the page.
        """
        self._session = session
        self._answering = answering
        self._asks = asks
        self._traits = traits
        self._clock = clock
        self._rng = np.random.default_rng([seed, traits.number, 3])
        self._count = 0
        self._looked_at = self._step_at = clock.now()
        self._step = ""
        self.armed = 0
        """How often the researcher armed the robot."""

    def tick(self) -> bool:
        """Look at the pages now and then; return whether something was asked for."""
        now = self._clock.now()
        if now - self._looked_at < LOOK_SECONDS:
            return False
        self._looked_at = now
        step = self._session.step
        name = step.id if step is not None else ""
        if name != self._step:
            self._step, self._step_at = name, now
        if self._session.progress.state == "new":
            return self._researcher("begin")
        if step is None:
            return False
        if (action := self._researcher_action(step)) is not None:
            return self._researcher(action, step.id)
        if now - self._step_at < READING_SECONDS:
            return False
        may = self._answering.may_participant()
        return bool(may) and self._participant(may[0], step)

    def _researcher_action(self, step: Step) -> ResearcherAction | None:
        session = self._session
        stage = session.moment.stage
        if stage == "idle" and step.kind == "baseline" and session.moment.trouble == UNMEASURED:
            return "next"  # a simulated heart that is silent stays so
        if stage == "idle" and "begin" in self._answering.may_researcher():
            return "begin"
        is_game = step.kind in PLAYED and step.kind != "explore"
        if is_game and stage == "ready" and session.heard.mode in SHUT:
            return "reset" if session.heard.mode == "tripped" else "arm"
        return None

    def _researcher(self, action: ResearcherAction, step: str = "") -> bool:
        self.armed += action == "arm"
        self._asks.put(ResearcherAsk(id=self._id(), action=action, step=step))
        return True

    def _participant(self, action: ParticipantAction, step: Step) -> bool:
        answers = self._answers(step) if action in ("answers", "ranking") else ()
        self._asks.put(ParticipantAsk(id=self._id(), action=action, step=step.id, answers=answers))
        return True

    def _id(self) -> str:
        self._count += 1
        return f"simulated-{self._count}"

    def _answers(self, step: Step) -> tuple[Answer, ...]:
        instrument = self._session.plan.protocol.instrument_named(step.instrument)
        return tuple(self._answer(item, step) for item in instrument.item)

    def _answer(self, item: Item, step: Step) -> Answer:
        if item.scale == "ranking":
            scores = [self._mean_score(number) for number in sections_to_rank(self._session)]
            return Answer(item=item.id, ranks=attitudes.ranks(item, scores, self._rng))
        if item.scale == "choices":
            return Answer(item=item.id, choices=attitudes.choices(item, self._rng))
        if item.scale == "open":
            return Answer(item=item.id, text=attitudes.words(item, self._traits))
        means = [self._mean_score(number) for number in sections_to_rank(self._session)]
        success = attitudes.standardised(self._mean_score(step.section), means)
        return Answer(
            item=item.id, value=attitudes.points(item, self._traits, success, self._rng)
        )  # fmt: skip

    def _mean_score(self, section: int) -> float:
        """Return the mean score of a section's games that count; 0 where there is none."""
        progress = self._session.progress
        scores = [
            attempt.end.score
            for step in self._session.plan.steps
            if step.section == section and step.kind == "game"
            and (attempt := progress.finished(step.id)) is not None
            and attempt.end is not None and attempt.end.score is not None
        ]  # fmt: skip
        return float(np.mean(scores)) if scores else 0.0
