"""A simulated participant on the bus: holds a bat as a page does, wears a strap, gets better."""

from collections import Counter
from typing import Final

import numpy as np

from services.robot_io.heart_rate.source import Beat
from shared.bus.base import Bus
from shared.clock import Clock
from shared.game.geometry import Target
from shared.messages.play import BatStates, RefereeState, TrackerPose
from shared.messages.topics import BATS, REFEREE, TRACKER
from shared.policy.scripted.sight import Arena
from shared.study.people.fencer import Fencer
from shared.study.people.heart import WALKING, Heart, effort_of
from shared.study.people.population import Traits
from shared.study.people.skill import character_at

SEARCH_SECONDS: Final = 20.0
"""Of an exploration; then the target is found, and the rest is spent standing (s)."""
LONGEST_STEP: Final = 0.1
"""What is longer is a leap of the clock, in which the hand is not moved (s)."""
BEAT_SECONDS: Final = 1.0
"""From one measurement of the strap to the next (s)."""
SPEED_SECONDS: Final = 5.0
"""Over which the effort of a game is felt (s)."""
STILL: Final = 0.0
"""Speed of the robot in an exploration, as the referee says it."""


class RehearsalPerson:
    """Hand, heart and practice of one participant; a tick for each tick of the robot's loop."""

    name: str = "simulated-heart"
    """Of the strap, for the record."""

    def __init__(
        self, traits: Traits, arena: Arena, target: Target, seed: int, clock: Clock
    ) -> None:
        """Stand ready.

        Args:
            traits: who it is.
            arena: the sizes of the game.
            target: where it is.
            seed: of the study.
            clock: times beats.
        """
        self._traits = traits
        self._clock = clock
        self._rng = np.random.default_rng([seed, traits.number, 2])
        character = character_at(*traits.shares(0, 0))
        self._fencer = Fencer(arena, target, character, self._rng)
        self._source = f"simulated-person-{traits.number}"
        self._sequence = 0
        self._moved_at = clock.now()
        self._bus: Bus | None = None
        self._said: RefereeState | None = None
        self._bout = ""
        self._games: Counter[str] = Counter()
        """Played to their end, by opponent."""
        self._heart = Heart(traits.resting, traits.age)
        self._speed = 0.0
        self._last = self._fencer.pose()
        self._beat_at = self._heart_at = clock.now()
        self.is_walking = False
        """Set by whoever leads it through the study: a baseline is walked."""
        self.is_sitting = True

    def join(self, bus: Bus) -> None:
        """Take an end of the bus."""
        self._bus = bus
        self._bats = bus.subscribe(BATS)
        self._referee = bus.subscribe(REFEREE)

    @property
    def is_searching(self) -> bool:
        """Return whether an exploration runs and the target is not found yet."""
        said = self._said
        return said is not None and said.speed == STILL and said.seconds < SEARCH_SECONDS

    @property
    def is_playing(self) -> bool:
        """Return whether the bat must be moved, and everything judged, tick by tick."""
        said = self._said
        if said is None or said.phase != "running":
            return False
        return said.speed != STILL or self.is_searching

    def tick(self) -> bool:
        """Move the bat where new states have arrived."""
        assert self._bus is not None, "join the bus first"
        if (said := self._referee.take()) is not None:
            self._hear(said)
        newest: BatStates | None = None
        while (states := self._bats.take()) is not None:
            newest = states
        if newest is None:
            return False
        now = self._clock.now()
        seconds, self._moved_at = min(now - self._moved_at, LONGEST_STEP), now
        if seconds <= 0.0:
            return False
        if self.is_playing:
            pose = self._fencer.play(newest.bats, newest.seconds, seconds)
        else:
            pose = self._fencer.wait(seconds)
        moved = float(np.linalg.norm(pose[:3] - self._last[:3]))
        self._last = pose
        self._speed += (moved / seconds - self._speed) * min(seconds / SPEED_SECONDS, 1.0)
        message = TrackerPose(sequence=self._sequence, source=self._source, pose=pose)
        self._bus.publish(TRACKER, message)
        self._sequence += 1
        return True

    def _hear(self, said: RefereeState) -> None:
        before, self._said = self._said, said
        if said.speed == STILL:
            return
        if said.phase == "running" and said.bout != self._bout:
            self._bout = said.bout
            here, everywhere = self._games[said.protagonist], self._games.total()
            shares = self._traits.shares(here, everywhere, self._rng)
            self._fencer.become(character_at(*shares))
        is_new = before is None or before.phase != "finished" or before.bout != said.bout
        if said.phase == "finished" and is_new and said.bout == self._bout:
            self._games[said.protagonist] += 1

    # -- the strap: a source of heart rates for robot_io ----------------------------------------

    def take(self, now: float) -> Beat | None:
        """Return a measurement a second."""
        if now - self._beat_at < BEAT_SECONDS:
            return None
        self._beat_at = now
        seconds, self._heart_at = now - self._heart_at, now
        rate = self._heart.go_on(self._effort(), seconds)
        return Beat(
            at=now,
            at_ns=self._clock.wall_ns(),
            beats_per_minute=rate + 1.0 * self._rng.standard_normal(),
        )

    def _effort(self) -> float:
        if self.is_walking:
            return WALKING
        if self.is_sitting:
            return 0.0
        return effort_of(self._speed, self._traits.exertion)

    def counters(self) -> dict[str, int]:
        """Return nothing: this strap has no trouble."""
        return {}

    @property
    def problem(self) -> str:
        """Return no problem."""
        return ""

    def close(self) -> None:
        """Nothing to let go of."""
