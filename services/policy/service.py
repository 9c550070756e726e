"""The policy's work: the newest bat states in, one offset out, and new players between bouts."""

import structlog

from services.policy.acting import HOLD, Acting
from services.policy.config import PolicyConfig
from services.policy.loading import Loader
from shared.bus.base import Bus
from shared.clock import Clock
from shared.errors import SnapshotError
from shared.game.live import is_sound
from shared.messages.play import (
    BatStates,
    DesiredOffset,
    PlayerReply,
    PlayerRequest,
)
from shared.messages.topics import BATS, OFFSET, PLAYER, REFEREE
from shared.messages.training import Agent
from shared.runtime.durations import Durations
from shared.runtime.rate import Rate
from shared.runtime.service import Health

BEHIND_SECONDS = 0.1
"""States with less game time than the referee's by more were made before robot_io heard of the
bout, or of the end of a pause."""
QUIET_SECONDS = 1.0
"""Without states for so long, the policy says whom it waits for."""
KEPT = 1000
"""Answers whose lateness is looked back on: 10 s at 100 Hz."""

log = structlog.get_logger()


class Policy:
    """Plays one side; a service that ticks.

    While a bout runs it answers as its player does; at all other times it asks for no offset, so
    that a player sees whole bouts and nothing else, as in training. States that are stale, not
    tracked or not numbers get no answer at all: robot_io holds when answers stay away.
    """

    def __init__(
        self, cfg: PolicyConfig, agent: Agent, loader: Loader, acting: Acting, bus: Bus,
        clock: Clock,
    ) -> None:  # fmt: skip
        """Load the player and join the bus.

        Args:
            cfg: who plays, and what is stale.
            agent: the side.
            loader: finds a player by what people call it.
            acting: encoder and decoder.
            bus: this process's end of the bus.
            clock: measures lateness.

        Raises:
            SnapshotError: there is no such player, or it does not fit.
        """
        self._cfg = cfg
        self._agent: Agent = agent
        self._loader = loader
        self._named = loader.load(cfg.antagonist if agent == "antagonist" else cfg.protagonist)
        self._acting = acting
        self._bus = bus
        self._clock = clock
        self._bats = bus.subscribe(BATS)
        self._referee = bus.subscribe(REFEREE)
        self._requests = bus.answer(PLAYER, agent=agent)
        self._phase = ""
        """Of the bout, as the referee said last."""
        self._referee_at = clock.now()
        self._game_seconds = 0.0
        """The referee's game time, as it said last."""
        self._boot = ""
        self._tick = -1
        self._states_at = clock.now()
        self._took = Durations("took_ms_{}", KEPT)
        self._age = Durations("age_ms_{}", KEPT)
        self._rate = Rate(clock)
        self._last_error = ""
        self._trouble = ""
        """Counter of why the newest states got no answer; empty when they did."""
        self._counters = {
            "answered": 0,
            "answered_hold": 0,
            "ticks_skipped": 0,
            "states_late": 0,
            "states_invalid": 0,
            "states_stale": 0,
            "states_refused": 0,
            "answers_refused": 0,
            "players_changed": 0,
            "players_refused": 0,
        }
        bus.alive("referee")  # begins to watch for one
        log.info("player_loaded", agent=agent, player=self._named.reference)

    @property
    def is_in_bout(self) -> bool:
        """Return whether a bout runs, as far as the referee has said lately."""
        silence = self._clock.now() - self._referee_at
        return self._phase == "running" and silence <= self._cfg.referee_silence

    def tick(self) -> bool:
        """Answer the newest states; change the player where that is asked for."""
        arrived_at = self._clock.now()
        did = self._hear_referee()
        if (states := self._newest()) is not None:
            did = True
            self._states_at = arrived_at
            if self._is_usable(states):
                self._answer(states, arrived_at)
        while (request := self._requests.take()) is not None:
            did = True
            request.reply(self._change_player(request.message))
        return did

    def _hear_referee(self) -> bool:
        if (said := self._referee.take()) is None:
            return False
        self._phase = said.phase
        self._game_seconds = said.seconds
        self._referee_at = self._clock.now()
        return True

    def _newest(self) -> BatStates | None:
        """Return the newest states that have arrived, if newer than the ones before."""
        newest: BatStates | None = None
        while (states := self._bats.take()) is not None:
            if states.boot == self._boot and states.tick <= self._tick:
                self._counters["states_late"] += 1
                continue
            self._counters["ticks_skipped"] += newest is not None
            self._boot, self._tick = states.boot, states.tick
            newest = states
        return newest

    def _is_usable(self, states: BatStates) -> bool:
        if not states.is_valid.all():
            return self._refuse("states_invalid", "a bat is not tracked; look at the tracker")
        if not is_sound(states.bats).all():
            return self._refuse("states_refused", "a bat's state is not finite, or no pose")
        age = 1e-9 * (self._clock.wall_ns() - states.at_ns)
        self._age.add(1e3 * age)
        if abs(age) > self._cfg.stale_after:
            return self._refuse(
                "states_stale",
                f"states are {age:.3f} s old by the clock, over {self._cfg.stale_after:g} s; "
                "look at the load of this machine, and at the clocks if there are several",
            )
        return True

    def _refuse(self, counter: str, reason: str) -> bool:
        self._counters[counter] += 1
        if counter != self._trouble:  # once per event, not per tick
            log.warning("states_not_answered", counter=counter, reason=reason)
        self._trouble = counter
        self._last_error = reason
        return False

    def _answer(self, states: BatStates, arrived_at: float) -> None:
        offset = HOLD
        is_in_bout = self.is_in_bout and states.seconds >= self._game_seconds - BEHIND_SECONDS
        if is_in_bout:
            found = self._acting.offset(self._named.player, states.bats, states.seconds)
            if found is None:
                self._refuse("answers_refused", f"{self._named.reference} answered no number")
                return
            offset = found
        took_ms = 1e3 * (self._clock.now() - arrived_at)
        answer = DesiredOffset(
            agent=self._agent,
            tick=states.tick,
            boot=states.boot,
            snapshot=self._named.reference,
            offset=offset,
            took_ms=took_ms,
        )
        self._bus.publish(OFFSET, answer, agent=self._agent)
        self._trouble = ""
        self._took.add(took_ms)
        self._rate.add(1)
        self._counters["answered" if is_in_bout else "answered_hold"] += 1

    def _change_player(self, asked: PlayerRequest) -> PlayerReply:
        """Load another player unless a bout is on; who cannot be loaded changes nothing."""
        reason = ""
        is_on = self._phase in ("running", "paused")
        if is_on and (self.is_in_bout or self._bus.alive("referee")):
            reason = f"a bout is {self._phase}: players change between bouts only"
        else:
            try:
                self._named = self._loader.load_asked(asked.player)
            except SnapshotError as error:
                reason = str(error)
        if reason:
            self._counters["players_refused"] += 1
            self._last_error = reason
            log.warning("player_refused", player=asked.player, reason=reason)
        else:
            self._counters["players_changed"] += 1
            log.info("player_loaded", agent=self._agent, player=self._named.reference)
        return PlayerReply(accepted=not reason, player=self._named.reference, reason=reason)

    def health(self) -> Health:
        """Return who plays, how late the answers are, and what was not answered."""
        silence = self._clock.now() - self._states_at
        waits = silence > QUIET_SECONDS
        doing = "plays" if self.is_in_bout else "holds still, no bout runs,"
        return Health(
            state=f"{self._named.reference[:19]} {doing} as {self._agent}",
            waiting_for="robot_io: bat states" if waits else "",
            waiting_seconds=silence if waits else 0.0,
            rates={
                "answers_per_s": self._rate.per_second(),
                **self._took.percentiles(),
                **self._age.percentiles(),
            },
            counters=dict(self._counters),
            last_error=self._last_error,
        )

    def close(self) -> None:
        """Answer nobody any more; robot_io holds by itself."""
        self._bats.close()
        self._referee.close()
        self._requests.close()
