"""The course of a match: arms a simulated robot once, starts bouts, keeps their scores.

It speaks to robot_io and the referee as a person at a button would, and it never arms a robot
again: when the gate has shut, or a process that the robot depends on has died, the robot stays
where it is until somebody arms it.
"""

import math
from typing import Literal

import msgspec
import structlog

from shared.bus.base import Bus, NoAnswer, Pending, Refused
from shared.clock import Clock
from shared.messages.play import (
    GateReply,
    GateRequest,
    GateState,
    PlayReply,
    PlayRequest,
    RefereeState,
)
from shared.messages.topics import ARM, BOUT, GATE, REFEREE

ASK_SECONDS = 1.0
"""Longest wait for an answer."""
AGAIN_SECONDS = 0.5
"""From a request that was refused to the next try."""
SILENCE_SECONDS = 1.0
"""A gate that has not been heard for so long is gone."""
MOVING = ("ramping", "armed", "holding")
ON = ("running", "paused")
OVER = ("finished", "void")
MOST_VOID = 20
"""Bouts in a row that come to nothing; then the match ends."""

log = structlog.get_logger()


class BoutResult(msgspec.Struct, frozen=True, kw_only=True):
    """What came of a bout."""

    bout: str
    outcome: Literal["finished", "void"]
    antagonist: str
    protagonist: str
    score: float
    """The antagonist's."""
    seconds: float
    attack_steps: int
    penalty_steps: int
    camping_steps: int
    missed_ticks: int
    reason: str = ""
    """Why it is void."""


class Terms(msgspec.Struct, frozen=True, kw_only=True):
    """What was agreed on before the match."""

    antagonist: str
    protagonist: str
    """Player references."""
    bouts: int
    """0: no end."""
    arms: bool
    """Whether to arm the robot once, at the beginning."""
    starts: bool
    """Whether to start the bouts; else somebody else does."""
    ends: bool = True
    """Whether to abandon a bout in which the robot cannot move any more."""
    rest: float
    """Before each bout (s)."""
    patience: float
    """The longest wait for a person (s)."""
    operator: str
    again: str
    """Command that arms the robot again, for people to read."""


class Match:
    """Follows a match and drives it; tick it often, it never waits."""

    def __init__(self, terms: Terms, bus: Bus, clock: Clock) -> None:
        """Listen.

        Args:
            terms: what was agreed on.
            bus: this process's end of the bus.
            clock: times rests and waits.
        """
        self.terms = terms
        self.results: list[BoutResult] = []
        self.gate: GateState | None = None
        self.referee: RefereeState | None = None
        self.ended = ""
        """Why the match is over before its last bout."""
        self.waits_for = ""
        """What it waits for; empty when it does not."""
        self._bus = bus
        self._clock = clock
        bus.alive("referee")  # begins to watch for one
        self._gates = bus.subscribe(GATE)
        self._said = bus.subscribe(REFEREE)
        now = clock.now()
        self._gate_at = -math.inf
        self._was_armed = not terms.arms
        self._arming: Pending[GateReply] | None = None
        self._disarming: Pending[GateReply] | None = None
        self._disarms = ""
        """Why the robot is to be disarmed; empty when it is not."""
        self._starting: Pending[PlayReply] | None = None
        self._abandoning: Pending[PlayReply] | None = None
        self._retry_at = self._stop_at = now
        self._rest_until = now + terms.rest
        self._moved_at = now
        """When the match waited for nobody last."""
        self._recorded = ""
        """The bout whose end was entered last."""
        self._events: list[str] = []

    @property
    def finished(self) -> int:
        """Return how many bouts came to their end."""
        return sum(result.outcome == "finished" for result in self.results)

    @property
    def is_over(self) -> bool:
        """Return whether there is nothing left to do."""
        return bool(self.ended) or 0 < self.terms.bouts <= self.finished

    @property
    def is_bout_on(self) -> bool:
        """Return whether a bout runs or is paused, as far as the referee has said lately."""
        state = self.referee
        return state is not None and state.phase in ON and bool(self._bus.alive("referee"))

    @property
    def rest_seconds(self) -> float:
        """Return how much of the rest is left (s)."""
        return max(self._rest_until - self._clock.now(), 0.0)

    def take_events(self) -> list[str]:
        """Return what happened since the last call, in words."""
        events, self._events = self._events, []
        return events

    def tick(self) -> None:
        """Take what was said, ask for what comes next."""
        now = self._clock.now()
        self.hear()
        if self._disarms:
            self._disarm(now)
        elif not self._was_armed:
            self._arm(now)
        if self.terms.ends:
            self._end_bout_of_a_shut_gate(now)
        if self.terms.starts and not self.is_over:
            self._start(now)
            self._watch_patience(now)

    def on_death(self, name: str) -> None:
        """Disarm the robot, for a process that it depends on has died."""
        self._disarms = f"{name} died"
        self._stop_at = self._clock.now()

    def shut(self) -> Pending[GateReply]:
        """Ask for the robot to be disarmed and a bout to be abandoned, at the end of the match."""
        self._was_armed = True  # nobody arms it from here on
        if self.is_bout_on and self.referee is not None:
            asked = PlayRequest(
                action="abandon", bout=self.referee.bout, reason="the match was stopped"
            )
            self._bus.ask(BOUT, asked, ASK_SECONDS)
        disarm = GateRequest(action="disarm", operator=self.terms.operator)
        return self._bus.ask(ARM, disarm, ASK_SECONDS)

    def close(self) -> None:
        """Stop listening."""
        self._gates.close()
        self._said.close()

    # -- listening --------------------------------------------------------------------------

    def hear(self) -> None:
        """Take what was said, and ask for nothing."""
        now = self._clock.now()
        if (gate := self._gates.take()) is not None:
            before, self.gate, self._gate_at = self.gate, gate, now
            if before is None or before.mode != gate.mode:
                self._note_gate(before, gate)
        while (state := self._said.take()) is not None:
            said, self.referee = self.referee, state
            self._note_phase(said, state)

    def _note_gate(self, before: GateState | None, gate: GateState) -> None:
        words = f"robot {gate.mode}" + (f": {gate.reason}" if gate.reason else "")
        was_moving = before is not None and before.mode in MOVING
        if gate.mode in ("tripped", "disarmed") and was_moving and not self.ended:
            words += f"; it stays where it is until somebody arms it: {self.terms.again}"
        self._say(words)

    def _note_phase(self, before: RefereeState | None, state: RefereeState) -> None:
        is_new = before is None or (before.bout, before.phase) != (state.bout, state.phase)
        if not is_new or not state.bout:
            if before is not None and not state.bout and before.phase in ON:
                self._say(f"{before.bout} is lost: the referee was restarted")
                self._enter(before, "void", "the referee was restarted")
            return
        if state.phase in OVER:
            self._enter(state, "finished" if state.phase == "finished" else "void", state.reason)
        words = f"{state.bout} {state.phase}" + (f": {state.reason}" if state.reason else "")
        if state.phase in OVER:
            words += f", score {state.score:+g} after {state.seconds:.1f} s"
        self._say(words)

    def _enter(
        self, state: RefereeState, outcome: Literal["finished", "void"], reason: str
    ) -> None:
        if state.bout == self._recorded:
            return
        self._recorded = state.bout
        self._rest_until = self._clock.now() + self.terms.rest
        self.results.append(
            BoutResult(
                bout=state.bout,
                outcome=outcome,
                antagonist=state.antagonist,
                protagonist=state.protagonist,
                score=state.score,
                seconds=state.seconds,
                attack_steps=state.attack_steps,
                penalty_steps=state.penalty_steps,
                camping_steps=state.camping_steps,
                missed_ticks=state.missed_ticks,
                reason=reason,
            )
        )
        recent = self.results[-MOST_VOID:]
        if len(recent) == MOST_VOID and all(result.outcome == "void" for result in recent):
            self._end(f"{MOST_VOID} bouts in a row were void, the last one because {reason}")

    # -- asking -----------------------------------------------------------------------------

    def _arm(self, now: float) -> None:
        """Arm the robot, once: the person has asked for it by typing the command."""
        if self._arming is None:
            if self.gate is None or now < self._retry_at:
                return
            asked = GateRequest(action="arm", operator=self.terms.operator)
            self._arming = self._bus.ask(ARM, asked, ASK_SECONDS)
            return
        if (answer := self._arming.take()) is None:
            return
        self._arming = None
        self._retry_at = now + AGAIN_SECONDS
        if isinstance(answer, GateReply) and (answer.accepted or answer.mode in MOVING):
            self._was_armed = True
            self.waits_for = ""
        elif isinstance(answer, GateReply):
            self.waits_for = f"the robot to be armed: {'; '.join(answer.reasons)}"
        else:
            self.waits_for = f"robot_io: {answer.reason}"

    def _disarm(self, now: float) -> None:
        """Shut the gate, if it is not shut yet."""
        self._was_armed = True  # what was asked for by typing is used up
        if self._disarming is not None:
            if (answer := self._disarming.take()) is None:
                return
            self._disarming = None
            if isinstance(answer, GateReply):
                self._disarms = ""
            return
        if now >= self._stop_at:
            self._stop_at = now + AGAIN_SECONDS
            asked = GateRequest(action="disarm", operator=f"riposte play ({self._disarms})")
            self._disarming = self._bus.ask(ARM, asked, ASK_SECONDS)

    def _end_bout_of_a_shut_gate(self, now: float) -> None:
        """Abandon a bout in which the robot cannot move any more."""
        if self._abandoning is not None:
            if self._abandoning.take() is not None:
                self._abandoning = None
                self._stop_at = now + AGAIN_SECONDS
            return
        state, gate = self.referee, self.gate
        if state is None or gate is None or not self.is_bout_on or now < self._stop_at:
            return
        if gate.mode in MOVING and now - self._gate_at <= SILENCE_SECONDS:
            return
        is_silent = now - self._gate_at > SILENCE_SECONDS
        why = "robot_io is silent" if is_silent else f"the robot is {gate.mode}: {gate.reason}"
        asked = PlayRequest(action="abandon", bout=state.bout, reason=why)
        self._abandoning = self._bus.ask(BOUT, asked, ASK_SECONDS)

    def _start(self, now: float) -> None:
        """Start the next bout when the robot is armed and the rest is over."""
        if self._starting is not None:
            if (answer := self._starting.take()) is not None:
                self._starting = None
                self._take_start(answer, now)
            return
        gate = self.gate
        if self.is_bout_on or not self._was_armed:
            return
        if gate is None or now - self._gate_at > SILENCE_SECONDS:
            self.waits_for = "robot_io"
        elif gate.mode != "armed":
            self.waits_for = f"the robot to be armed ({gate.mode}: {gate.reason})"
        elif not self._bus.alive("referee"):
            self.waits_for = "the referee"
        elif now < self._rest_until:
            self.waits_for = ""
        elif now >= self._retry_at:
            asked = PlayRequest(
                action="start",
                bout=f"bout-{len(self.results) + 1}",
                antagonist=self.terms.antagonist,
                protagonist=self.terms.protagonist,
            )
            self._starting = self._bus.ask(BOUT, asked, ASK_SECONDS)

    def _take_start(self, answer: PlayReply | Refused | NoAnswer, now: float) -> None:
        is_accepted = isinstance(answer, PlayReply) and answer.accepted
        self.waits_for = "" if is_accepted else f"the referee: {answer.reason}"
        self._retry_at = now + AGAIN_SECONDS

    def _watch_patience(self, now: float) -> None:
        if not self.waits_for:
            self._moved_at = now
        elif now - self._moved_at > self.terms.patience:
            self._end(f"waited {self.terms.patience:g} s for {self.waits_for}")

    def _end(self, why: str) -> None:
        self.ended = why
        self._say(f"the match ends: {why}")

    def _say(self, text: str) -> None:
        log.info("match_event", text=text)
        self._events.append(text)
