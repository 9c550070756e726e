"""How a person's hand moves: minimum jerk, signal-dependent noise, and no farther than the arm.

Minimum jerk: Flash & Hogan 1985, J. Neurosci. 5:1688. Noise whose standard deviation grows with
the motor command: Harris & Wolpert 1998, Nature 394:780. Segment lengths as shares of the body
height: Drillis & Contini 1966, in Winter, Biomechanics and Motor Control of Human Movement.
"""

import dataclasses

import numpy as np
from numpy.typing import NDArray

from shared.game.geometry import length
from shared.policy.scripted.blades import turn_between, turned
from shared.policy.scripted.memory import Bools, Memory

Floats = NDArray[np.float64]
Float32s = NDArray[np.float32]

HEIGHT = 1.75
"""Of the body (m)."""
ARM = (0.186 + 0.146 + 0.5 * 0.108) * HEIGHT
"""Shoulder to the middle of the hand: upper arm, forearm, half the hand (m)."""
SHOULDER = (-1.0, -0.188, -0.06)
"""In the arena frame of its side, where the right shoulder of a PR2 is (m)."""
PEAK_OVER_MEAN = 1.875
"""Highest over mean speed of a minimum-jerk movement."""
SHORTEST = 0.15
"""Duration of the shortest movement (s)."""


def minimum_jerk(share: Floats) -> Floats:
    """Return how much of the way is done after a share of the time, both in [0, 1]."""
    tau = np.clip(share, 0.0, 1.0)
    return tau * tau * tau * (10.0 - 15.0 * tau + 6.0 * tau * tau)


def within_reach(grips: Floats) -> Floats:
    """Return the points, those beyond the arm's length moved onto its sphere: float64[3, N]."""
    shoulder = np.array(SHOULDER)[:, None]
    away = grips - shoulder
    return shoulder + away * np.minimum(1.0, ARM / np.maximum(length(away), 1e-9))


def noisy(actions: Float32s, noise: float, generator: np.random.Generator) -> Float32s:
    """Return actions, first shortened to their bounds, with noise in proportion to their size.

    Args:
        actions: float32[N, 6], translation and rotation in units of their bounds.
        noise: standard deviation over size of a command.
        generator: draws it.
    """
    vectors: Float32s = actions.reshape(-1, 2, 3)
    sizes: Float32s = np.sqrt(np.add.reduce(vectors * vectors, axis=-1, keepdims=True))
    bounded: Float32s = np.divide(vectors, np.maximum(sizes, 1.0), dtype=np.float32)
    drawn: Float32s = generator.standard_normal(vectors.shape, np.float32)
    bounded += np.float32(noise) * np.minimum(sizes, 1.0) * drawn
    return bounded.reshape(actions.shape)


@dataclasses.dataclass(frozen=True)
class Reaching:
    """Movements of N hands under way, kept in a memory."""

    memory: Memory
    peak_speed: float
    """Of the grip (m/s)."""

    def allocate(self, count: int) -> None:
        """Make room for the movements of N worlds."""
        for name in ("from_grip", "from_blade", "to_grip", "turn"):
            self.memory[name] = np.zeros((3, count))
        self.memory["began"] = np.zeros(count)
        self.memory["duration"] = np.full(count, SHORTEST)

    def begin(
        self, where: Bools, now: Floats, start: tuple[Floats, Floats], end: tuple[Floats, Floats]
    ) -> None:
        """Begin a movement in some worlds.

        Args:
            where: bool[N], which.
            now: float64[N], game time (s).
            start: float64[3, N] each, grips and blades now.
            end: float64[3, N] each, grips and blades then.
        """
        memory = self.memory
        grips = within_reach(end[0][:, where])
        turn = turn_between(start[1][:, where], end[1][:, where])
        memory["from_grip"][:, where] = start[0][:, where]
        memory["from_blade"][:, where] = start[1][:, where]
        memory["to_grip"][:, where] = grips
        memory["turn"][:, where] = turn
        memory["began"][where] = now[where]
        # A turn of the blade takes the time in which the middle of the blade goes its arc.
        way = np.maximum(length(grips - start[0][:, where]), 0.35 * length(turn))
        memory["duration"][where] = np.maximum(SHORTEST, PEAK_OVER_MEAN * way / self.peak_speed)

    def pose(self, now: Floats) -> tuple[Floats, Floats]:
        """Return where grips and blades should be now: float64[3, N] each."""
        memory = self.memory
        done = minimum_jerk((now - memory["began"]) / memory["duration"])
        start = memory["from_grip"]
        grips = start + done * (memory["to_grip"] - start)
        return grips, turned(memory["from_blade"], done * memory["turn"])

    def arrived_for(self, now: Floats) -> Floats:
        """Return float64[N], seconds since the movement should have ended; negative before."""
        return now - self.memory["began"] - self.memory["duration"]
