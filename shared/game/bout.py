"""The course of bouts: N scoreboards for the two judges, and the phases of a live bout."""

import dataclasses
import enum

import numpy as np
from numpy.typing import NDArray

from shared.game.geometry import (
    BatShape,
    Target,
    blade_direction,
    distance_between_bats,
    distance_to_target,
)
from shared.game.rules import (
    RuleBook,
    attack_points,
    camping_points,
    count_camping,
    is_camping_paid,
)

Bools = NDArray[np.bool_]
Ints = NDArray[np.int32]
Longs = NDArray[np.int64]
Floats = NDArray[np.float64]


@dataclasses.dataclass(frozen=True)
class Judgement:
    """What one step of N bouts looked like, and what it paid.

    Of several steps at once: every array has the steps on an axis before the bouts.
    """

    points: Floats
    """float64[N], the antagonist's points."""
    camping_points: Floats
    """float64[N], how many of them the camping rule gave."""
    antagonist_in_target: Bools
    protagonist_in_target: Bools
    contact: Bools
    target_distance: Floats
    """float64[2, N] (m), surface to surface, antagonist first; negative inside."""
    bat_distance: Floats
    """float64[N] (m), surface to surface; negative where they overlap."""

    @property
    def newest(self) -> "Judgement":
        """Return the last step of several."""
        return Judgement(
            self.points[-1],
            self.camping_points[-1],
            self.antagonist_in_target[-1],
            self.protagonist_in_target[-1],
            self.contact[-1],
            self.target_distance[:, -1],
            self.bat_distance[-1],
        )


class Scoreboard:
    """The scores of N bouts played side by side; the actor and the referee call the same code."""

    def __init__(self, num_bouts: int, rules: RuleBook, bat: BatShape, target: Target) -> None:
        self.rules = rules
        self.bat = bat
        self.target = target
        self.step: Ints = np.zeros(num_bouts, np.int32)
        """Steps judged since each bout began."""
        self.camping: Ints = np.zeros(num_bouts, np.int32)
        """Consecutive steps the protagonist's bat has been in the target."""
        self.score: Floats = np.zeros(num_bouts)
        self.attack_steps: Ints = np.zeros(num_bouts, np.int32)
        self.penalty_steps: Ints = np.zeros(num_bouts, np.int32)
        self.camping_steps: Ints = np.zeros(num_bouts, np.int32)

    def judge(self, grips: Floats, quaternions: Floats) -> Judgement:
        """Score one step of every bout from the bats' poses.

        Args:
            grips: float64[3, 2, N], origins of the bat frames in the world, antagonist first.
            quaternions: float64[4, 2, N], their orientations, w x y z.
        """
        to_target, between = self._distances(grips, quaternions)
        in_target = to_target <= 0.0
        contact = between <= 0.0
        self.camping = count_camping(self.camping, in_target[1])
        camped = camping_points(self.camping, self.rules)
        points = attack_points(in_target[0], contact, self.rules) + camped
        self.step += 1
        self.score += points
        penalty = in_target[0] & contact
        self.penalty_steps += penalty
        self.attack_steps += in_target[0] ^ penalty
        self.camping_steps += is_camping_paid(self.camping, self.rules)
        return Judgement(points, camped, in_target[0], in_target[1], contact, to_target, between)

    def judge_steps(self, grips: Floats, quaternions: Floats) -> Judgement:
        """Score K steps that followed each other at once: the same verdicts for less time.

        Args:
            grips: float64[3, 2, K, N], as for ``judge``, in the order they were played.
            quaternions: float64[4, 2, K, N].

        Returns:
            Arrays with the steps before the bouts: [K, N], distances to the target [2, K, N].
        """
        to_target, between = self._distances(grips, quaternions)
        in_target = to_target <= 0.0
        contact = between <= 0.0
        camping = np.empty(contact.shape, np.int32)
        for step, is_inside in enumerate(in_target[1]):
            self.camping = camping[step] = count_camping(self.camping, is_inside)
        camped = camping_points(camping, self.rules)
        points = attack_points(in_target[0], contact, self.rules) + camped
        self.step += len(contact)
        self.score += points.sum(axis=0)
        penalty = in_target[0] & contact
        self.penalty_steps += penalty.sum(axis=0, dtype=np.int32)
        self.attack_steps += (in_target[0] ^ penalty).sum(axis=0, dtype=np.int32)
        self.camping_steps += is_camping_paid(camping, self.rules).sum(axis=0, dtype=np.int32)
        return Judgement(points, camped, in_target[0], in_target[1], contact, to_target, between)

    def _distances(self, grips: Floats, quaternions: Floats) -> tuple[Floats, Floats]:
        """Return how far the bats are from the target, and from each other."""
        directions = blade_direction(quaternions)
        to_target = distance_to_target(grips, directions, self.bat, self.target)
        between = distance_between_bats(
            grips[:, 0], directions[:, 0], grips[:, 1], directions[:, 1], self.bat
        )
        return to_target, between

    def finished(self) -> Bools:
        """Return bool[N], whether each bout has run its full time."""
        return self.step >= self.rules.bout_steps

    def reset(self, bouts: Longs, first_step: Ints | int = 0) -> None:
        """Start these bouts anew, at step 0 or where the stagger puts them.

        Args:
            bouts: int64[K], indices.
            first_step: int32[K] or one number, steps that count as already gone.
        """
        self.step[bouts] = first_step
        for counter in (self.camping, self.attack_steps, self.penalty_steps, self.camping_steps):
            counter[bouts] = 0
        self.score[bouts] = 0.0

    def state(self) -> dict[str, NDArray[np.generic]]:
        """Return copies of all counters, for a checkpoint."""
        names = ("step", "camping", "score", "attack_steps", "penalty_steps", "camping_steps")
        return {name: getattr(self, name).copy() for name in names}

    def restore(self, state: dict[str, NDArray[np.generic]]) -> None:
        """Continue from what ``state`` returned."""
        for name, value in state.items():
            getattr(self, name)[:] = value


class Phase(enum.Enum):
    """Where a live bout stands."""

    READY = "ready"
    RUNNING = "running"
    PAUSED = "paused"
    FINISHED = "finished"
    VOID = "void"


class Event(enum.Enum):
    """What moves a live bout on."""

    START = "start"
    PAUSE = "pause"
    RESUME = "resume"
    TIME_UP = "time_up"
    ABANDON = "abandon"


_TRANSITIONS: dict[tuple[Phase, Event], Phase] = {
    (Phase.READY, Event.START): Phase.RUNNING,
    (Phase.READY, Event.ABANDON): Phase.VOID,
    (Phase.RUNNING, Event.PAUSE): Phase.PAUSED,
    (Phase.RUNNING, Event.TIME_UP): Phase.FINISHED,
    (Phase.RUNNING, Event.ABANDON): Phase.VOID,
    (Phase.PAUSED, Event.RESUME): Phase.RUNNING,
    (Phase.PAUSED, Event.ABANDON): Phase.VOID,
}


def next_phase(phase: Phase, event: Event) -> Phase:
    """Return the phase of a live bout after an event.

    Raises:
        ValueError: if the event cannot happen in this phase.
    """
    try:
        return _TRANSITIONS[phase, event]
    except KeyError:
        possible = ", ".join(e.value for p, e in _TRANSITIONS if p is phase) or "none: it is over"
        raise ValueError(
            f"a bout that is {phase.value} cannot {event.value}; possible: {possible}"
        ) from None
