"""How much of a hidden effect shows: beyond noise, and beyond what a base fit makes up for.

The effect's change of the recordings, in noise floors, is projected off what small steps of the
base parameters change. Its mean square over the same plus 1, the noise, is the share of the
residual that there is to explain.
"""

import functools
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from shared.errors import SimulationError
from shared.identification.dataset.types import Float64
from shared.identification.hidden import noise
from shared.identification.hidden.recipe import Recipe
from shared.identification.hidden.recording import Plan, play
from shared.sim.hidden import spread
from shared.sim.hidden.arms import HiddenArm
from shared.sim.hidden.robot import Played, Robot
from shared.sim.plant.signals import pose_error, sampled_poses

_TRIES = 9
_CLOSE = 0.05
"""Of the logarithm of a power, that is close enough."""
_FAR = 6.0
"""From here on a power says little of how far the size is off."""


@dataclass
class Yardstick:
    """Measures what an effect does to some recordings of one robot."""

    recipe: Recipe
    arm: HiddenArm
    base: Callable[[], Robot]
    """Makes the robot without any effect."""
    plans: Sequence[Plan]

    def __post_init__(self) -> None:
        plain = self.base()
        self._usual = [play(plain, self.arm, plan, None) for plan in self.plans]
        self._floors = self._noise(plain)

    @functools.cached_property
    def _basis(self) -> Float64:
        """Return float64[M, n], orthonormal: what small steps of the base change."""
        columns: list[Float64] = []
        for change in spread.directions(self.arm):
            robot = self.base()
            change(robot)
            columns.append(self._difference(robot))
        basis, sizes, _ = np.linalg.svd(np.stack(columns, axis=1), full_matrices=False)
        return np.asarray(basis[:, sizes > 1e-6 * sizes[0]], np.float64)

    def power(self, robot: Robot) -> float:
        """Return the mean square, in noise floors, of what a robot does differently."""
        found = self._difference(robot)
        found = found - self._basis @ (self._basis.T @ found)
        return float(np.mean(found**2))

    def raw_power(self, robot: Robot) -> float:
        """Return the same with what a base fit makes up for."""
        return float(np.mean(self._difference(robot) ** 2))

    def size_for(
        self, share: float, low: float, high: float, make: Callable[[float], Robot]
    ) -> float:
        """Return about the size at which an effect makes a share of the residual, within its range.

        Args:
            share: wanted.
            low: the smallest size.
            high: the largest size.
            make: makes the robot with the effect at a size.
        """
        wanted = float(np.log(share / (1.0 - share)))
        begin, end = float(np.log(low)), float(np.log(high))
        size, best = 0.5 * (begin + end), (np.inf, low)
        for _ in range(_TRIES):
            try:
                found = float(np.log(max(self.power(make(float(np.exp(size)))), 1e-12)))
            except SimulationError:
                found = np.inf
            off = abs(found - wanted)
            best = min(best, (off, float(np.exp(size))))
            if off < _CLOSE:
                break
            if found < wanted:
                begin = size
            else:
                end = size
            # power goes with the square of the size; where it does not, halve what is left
            step = size + 0.5 * (wanted - found)
            margin = 0.05 * (end - begin)
            is_far = off > _FAR or not begin + margin < step < end - margin
            size = 0.5 * (begin + end) if is_far else step
        return best[1]

    def _noise(self, robot: Robot) -> tuple[Float64, Float64]:
        """Return float64[J] and float64[6]: noise floors, disturbances included."""
        levels = self.recipe.noise
        rng = np.random.default_rng(self.recipe.seed)
        joints, tracker = [np.zeros(len(self.arm.rest))], [np.zeros(6)]
        for plan, usual in zip(self.plans, self._usual, strict=True):
            steps = int(self.recipe.seconds / robot.timestep) + 2
            pushed = noise.disturbance(levels, self.arm.torque, steps, robot.timestep, rng)
            change = _changes(plan, play(robot, self.arm, plan, pushed), usual, None)
            joints.append(np.mean(change[0] ** 2, axis=0))
            if change[1] is not None:
                tracker.append(np.mean(change[1] ** 2, axis=0))
        count = len(self.plans)
        return (
            np.sqrt(levels.encoder**2 + sum(joints) / count),
            np.sqrt(levels.tracker**2 + sum(tracker) / count),
        )

    def _difference(self, robot: Robot) -> Float64:
        """Return what a robot does differently in all recordings, in noise floors, in one row."""
        parts: list[Float64] = []
        for plan, usual in zip(self.plans, self._usual, strict=True):
            joints, tracker = _changes(plan, play(robot, self.arm, plan, None), usual, robot)
            parts.append((joints / self._floors[0]).ravel())
            if tracker is not None:
                parts.append((tracker / self._floors[1]).ravel())
        return np.concatenate(parts)


def _changes(
    plan: Plan, one: Played, other: Played, robot: Robot | None
) -> tuple[Float64, Float64 | None]:
    """Return what is logged differently: float64[T, J] and float64[K, 6]."""
    if plan.tracker_at is None or one.tracker is None or other.tracker is None:
        return one.q - other.q, None
    at = plan.tracker_at if robot is None else robot.stamp(plan.tracker_at)
    return one.q - other.q, pose_error(
        sampled_poses(at, one.tracker, plan.tracker_at), other.tracker
    )
