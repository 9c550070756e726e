"""The referee's work: bat states in, requests of the people, score out."""

from collections.abc import Callable

import msgspec
import numpy as np
import structlog

from services.referee.bout import Fixture, LiveBout
from services.referee.config import RefereeConfig
from services.referee.tracking import Tracking
from shared.bus.base import Bus
from shared.clock import Clock
from shared.game.bout import Event, Phase, Scoreboard
from shared.messages.play import BatStates, PlayReply, PlayRequest, RefereeState
from shared.messages.topics import BATS, BOUT, REFEREE
from shared.runtime.rate import Rate
from shared.runtime.service import Health

TAKE_MOST = 64
"""States taken in one tick, so that a flood cannot hold up the requests."""
MAX_NAME = 128
"""Longest name of a bout or a player (characters)."""
MAX_REASON = 256
"""What is kept of a reason (characters)."""

MAX_SECONDS = 600.0
"""Longest bout that can be asked for (s)."""

log = structlog.get_logger()


class Referee:
    """Judges one bout at a time; a service that ticks."""

    def __init__(
        self, cfg: RefereeConfig, board: Callable[[], Scoreboard], timestep: float, bus: Bus,
        clock: Clock,
    ) -> None:  # fmt: skip
        """Join the bus; the first bout begins when it is asked for.

        Args:
            cfg: what tracking may lack.
            board: makes a fresh scoreboard of one bout.
            timestep: time from one tick of the bat states to the next (s).
            bus: this process's end of the bus.
            clock: times silence.
        """
        self._cfg = cfg
        self._board = board
        self._timestep = timestep
        self._bus = bus
        self._clock = clock
        self._tracking = Tracking(clock.now(), round(cfg.stale_after / timestep))
        self._bout: LiveBout | None = None
        self._bats = bus.subscribe(BATS)
        self._requests = bus.answer(BOUT)
        self._rate = Rate(clock)
        self._counters = {
            "bouts": 0, "steps": 0, "missed_ticks": 0, "requests_refused": 0,
        }  # fmt: skip
        self._last_error = ""
        bus.publish(REFEREE, self.state())

    def tick(self) -> bool:
        """Judge the states that have arrived and answer who asks; return whether any did."""
        now = self._clock.now()
        taken = 0
        while taken < TAKE_MOST and (states := self._bats.take()) is not None:
            taken += 1
            self._take_states(states, now)
        if taken < TAKE_MOST and self._bout is not None and self._bout.on_time(now):
            self._publish()
        did = taken > 0
        while (request := self._requests.take()) is not None:
            did = True
            request.reply(self._answer(request.message, now))
        return did

    def _take_states(self, states: BatStates, now: float) -> None:
        self._rate.add(1)
        arrival = self._tracking.take(states, now)
        bout = self._bout
        if arrival is None or bout is None:
            return
        steps, missed = int(bout.scores.step[0]), bout.missed_ticks
        if bout.on_states(arrival, now):
            self._counters["steps"] += int(bout.scores.step[0]) - steps
            self._counters["missed_ticks"] += bout.missed_ticks - missed
            self._publish()

    def _answer(self, asked: PlayRequest, now: float) -> PlayReply:
        """Let what is asked for happen, or say why not."""
        try:
            if asked.action == "start":
                self._start(asked, now)
            else:
                self._running_bout(asked.bout).on_event(
                    Event(asked.action), asked.reason[:MAX_REASON], now
                )
        except ValueError as error:
            self._counters["requests_refused"] += 1
            self._last_error = str(error)
            log.warning("request_refused", action=asked.action, reason=str(error))
            return PlayReply(accepted=False, phase=self.state().phase, reason=str(error))
        self._publish()
        return PlayReply(accepted=True, phase=self.state().phase)

    def _start(self, asked: PlayRequest, now: float) -> None:
        for what in ("bout", "antagonist", "protagonist"):
            if not 1 <= len(getattr(asked, what)) <= MAX_NAME:
                raise ValueError(f"{what} of a bout needs a name of 1 to {MAX_NAME} characters")
        if self._bout is not None:
            if not self._bout.is_over:
                name = self._bout.fixture.bout
                raise ValueError(f"bout {name!r} is {self._bout.phase.value}: abandon it first")
            if self._bout.fixture.bout == asked.bout:
                raise ValueError(f"there has been a bout {asked.bout!r}: give a new name")
        if not 0.0 <= asked.speed <= 1.0:  # also refuses NaN
            raise ValueError(f"a speed of {asked.speed:g} times the robot's: 0 to 1 can be asked")
        fixture = Fixture(
            asked.bout, asked.antagonist, asked.protagonist, asked.speed, asked.is_recorded
        )
        board = self._board()
        if asked.seconds != 0.0:
            if not self._timestep <= asked.seconds <= MAX_SECONDS:  # also refuses NaN
                raise ValueError(
                    f"a bout of {asked.seconds:g} s: {self._timestep:g} to {MAX_SECONDS:g} s can "
                    "be judged"
                )
            steps = round(asked.seconds / self._timestep)
            board.rules = msgspec.structs.replace(board.rules, bout_steps=steps)
        bout = LiveBout(fixture, board, self._tracking, self._cfg, self._timestep)
        bout.on_event(Event.START, "", now)
        self._bout = bout
        self._counters["bouts"] += 1

    def _running_bout(self, name: str) -> LiveBout:
        if self._bout is None:
            raise ValueError("there is no bout yet: start one")
        if self._bout.fixture.bout != name:
            raise ValueError(f"the bout is {self._bout.fixture.bout!r}, not {name[:MAX_NAME]!r}")
        return self._bout

    def _publish(self) -> None:
        self._bus.publish(REFEREE, self.state())

    def state(self) -> RefereeState:
        """Return where the bout stands."""
        if self._bout is not None:
            return self._bout.state()
        return RefereeState(
            bout="", phase=Phase.READY.value, antagonist="", protagonist="",
            tick=self._tracking.tick, step=0, seconds=0.0, score=0.0, points=0.0,
            in_target=np.zeros(2, np.bool_), contact=False, attack_steps=0, penalty_steps=0,
            camping_steps=0, missed_ticks=0, tone_hz=0.0,
        )  # fmt: skip

    def health(self) -> Health:
        """Return where the bout stands, and what arrived."""
        now = self._clock.now()
        silence = now - self._tracking.good_at
        state = self.state()
        words = f"{state.phase} {state.bout!r}" if state.bout else "no bout yet"
        return Health(
            state=f"{words}: {state.score:g} after {state.seconds:.2f} s" if state.bout else words,
            waiting_for="robot_io: bat states" if silence > self._cfg.stale_after else "",
            waiting_seconds=silence if silence > self._cfg.stale_after else 0.0,
            rates={"states_per_s": self._rate.per_second()},
            counters={**self._counters, **self._tracking.counters},
            last_error=self._last_error,
        )

    def close(self) -> None:
        """Say that a bout that is not over never will be."""
        if self._bout is not None and not self._bout.is_over:
            self._bout.on_event(Event.ABANDON, "the referee was stopped", self._clock.now())
            self._publish()
        self._bats.close()
        self._requests.close()
