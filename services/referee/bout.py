"""One live bout: its phase, its score, and what missing states do to it; knows no bus.

A tick that never arrived is judged as the one before it: it was 10 ms of the bout like any other,
and the best guess of where the bats were is where they were last seen. So game time keeps step
with the loop that tracks and moves the bats. That holds for gaps up to ``stale_after``; a longer
one pauses the bout, and what lies in a pause is not judged. A state in which a bat is not tracked
is judged as it stands (it holds the last pose that was) within the same limit.
"""

import dataclasses

import numpy as np
import structlog
from numpy.typing import NDArray

from services.referee.config import RefereeConfig
from services.referee.tracking import Arrival, Tracking
from shared.game.bout import Event, Judgement, Phase, Scoreboard, next_phase
from shared.game.live import SILENCE_HZ, judge_states, tone_of
from shared.messages.play import RefereeState

Floats = NDArray[np.float64]

log = structlog.get_logger()


@dataclasses.dataclass(frozen=True)
class Fixture:
    """Who plays, under which name."""

    bout: str
    antagonist: str
    protagonist: str
    speed: float = 1.0
    """Share of its speed that the robot's tool may have."""
    is_recorded: bool = True


class LiveBout:
    """A bout from its start to its verdict."""

    def __init__(
        self, fixture: Fixture, scores: Scoreboard, tracking: Tracking, cfg: RefereeConfig,
        timestep: float,
    ) -> None:  # fmt: skip
        """Make a bout that is ready to start.

        Args:
            fixture: who plays.
            scores: a fresh scoreboard of one bout.
            tracking: follows the states; it outlives the bout.
            cfg: what tracking may lack.
            timestep: time from one tick to the next (s).
        """
        self.fixture = fixture
        self.phase = Phase.READY
        self.reason = ""
        self.scores = scores
        self.missed_ticks = 0
        self._tracking = tracking
        self._cfg = cfg
        self._timestep = timestep
        self._waits_for_tracking = False
        self._verdict: Judgement | None = None
        self._tick = tracking.tick

    @property
    def is_over(self) -> bool:
        """Return whether nothing can happen to it any more."""
        return self.phase in (Phase.FINISHED, Phase.VOID)

    def on_event(self, event: Event, reason: str, now: float) -> None:
        """Let what a person asks for happen.

        Raises:
            ValueError: it cannot happen now; says why.
        """
        if event is Event.PAUSE and self._waits_for_tracking:  # stays paused, for the person
            phase = self.phase
        else:
            phase = next_phase(self.phase, event)
        if event in (Event.START, Event.RESUME) and (lack := self.lack_of_tracking(now)):
            raise ValueError(f"a bout cannot {event.value}: {lack}")
        self._waits_for_tracking = False
        self._move(phase, reason)

    def lack_of_tracking(self, now: float) -> str:
        """Return why the present tracking is too little to play on; empty when it is not."""
        tracking = self._tracking
        if not tracking.boot:
            return "no bat states arrive; start robot_io, or look at its messages"
        if (silence := now - tracking.good_at) > self._cfg.stale_after:
            return f"bats are not tracked (for {silence:.2f} s); look at robot_io and the tracker"
        good = tracking.good_ticks * self._timestep
        if good < self._cfg.resume_after - 0.5 * self._timestep:
            return (
                f"both bats have been tracked for {good:.2f} s, "
                f"{self._cfg.resume_after:g} s are needed; look at the tracker"
            )
        return ""

    def on_states(self, arrival: Arrival, now: float) -> bool:
        """Judge the states that ``tracking`` just took; return whether the bout changed."""
        if self.phase is Phase.PAUSED and self._waits_for_tracking:
            return self._on_states_in_pause(arrival, now)
        if self.phase is not Phase.RUNNING:
            return False
        if arrival.is_reboot:
            return self._void("robot_io was restarted during the bout")
        lost = arrival.untracked * self._timestep
        if lost > self._cfg.void_after + 0.5 * self._timestep:
            return self._void(f"bats were not tracked for {lost:.2f} s")
        if lost > self._cfg.stale_after + 0.5 * self._timestep:
            return self._wait_for_tracking(lost)
        if arrival.before is not None:
            for _ in range(arrival.missed):
                self._judge(arrival.before, is_missed=True)
        assert self._tracking.bats is not None  # it just took them
        self._judge(self._tracking.bats)
        return True

    def on_time(self, now: float) -> bool:
        """Pause or end a bout whose bats are not tracked; return whether it changed."""
        is_waiting = self.phase is Phase.PAUSED and self._waits_for_tracking
        if self.phase is not Phase.RUNNING and not is_waiting:
            return False
        lost = now - self._tracking.good_at
        if lost > self._cfg.void_after:
            return self._void(f"bats were not tracked for {lost:.2f} s")
        if lost > self._cfg.stale_after and not is_waiting:
            return self._wait_for_tracking(lost)
        return False

    def _on_states_in_pause(self, arrival: Arrival, now: float) -> bool:
        if arrival.is_reboot:
            return self._void("robot_io was restarted during the bout")
        if self.lack_of_tracking(now):
            return False
        self._waits_for_tracking = False
        return self._move(next_phase(self.phase, Event.RESUME), "")

    def _void(self, reason: str) -> bool:
        self._waits_for_tracking = False
        return self._move(next_phase(self.phase, Event.ABANDON), reason)

    def _wait_for_tracking(self, lost: float) -> bool:
        self._waits_for_tracking = True
        phase = next_phase(self.phase, Event.PAUSE)
        return self._move(phase, f"bats are not tracked (for {lost:.2f} s)")

    def _judge(self, bats: Floats, is_missed: bool = False) -> None:
        """Judge one step of a bout that is still running."""
        if self.phase is not Phase.RUNNING:
            return
        self._verdict = judge_states(self.scores, bats[None])
        self._tick = self._tracking.tick
        self.missed_ticks += is_missed
        if self.scores.finished()[0]:
            self._move(next_phase(self.phase, Event.TIME_UP), "")

    def _move(self, phase: Phase, reason: str) -> bool:
        self.phase, self.reason = phase, reason
        if phase is Phase.RUNNING:  # game time goes on from here, not from before a pause
            self._tick = self._tracking.tick
        log.info(
            f"bout_{phase.value}",
            bout=self.fixture.bout,
            reason=reason,
            step=int(self.scores.step[0]),
            score=float(self.scores.score[0]) if self.fixture.is_recorded else None,
            missed_ticks=self.missed_ticks,
        )
        return True

    def state(self) -> RefereeState:
        """Return where the bout stands."""
        scores, verdict = self.scores, self._verdict
        step = int(scores.step[0])
        in_target = np.zeros(2, np.bool_)
        contact, points, tone = False, 0.0, SILENCE_HZ
        if verdict is not None:
            in_target[:] = verdict.antagonist_in_target[0], verdict.protagonist_in_target[0]
            contact, points = bool(verdict.contact[0]), float(verdict.points[0])
            if self.phase is Phase.RUNNING:
                tone = tone_of(bool(in_target[0]), contact)
        return RefereeState(
            bout=self.fixture.bout,
            phase=self.phase.value,
            reason=self.reason,
            antagonist=self.fixture.antagonist,
            protagonist=self.fixture.protagonist,
            tick=self._tick,
            step=step,
            seconds=step * self._timestep,
            score=float(scores.score[0]),
            points=points,
            in_target=in_target,
            contact=contact,
            attack_steps=int(scores.attack_steps[0]),
            penalty_steps=int(scores.penalty_steps[0]),
            camping_steps=int(scores.camping_steps[0]),
            missed_ticks=self.missed_ticks,
            tone_hz=tone,
            speed=self.fixture.speed,
            is_recorded=self.fixture.is_recorded,
        )
