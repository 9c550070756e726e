"""Two antagonists: one stabs along its blade, one slashes across the target.

Both act at once on what they see and know where the target is. Hit inside the target, they leave
it at once; unhindered, the stabbing one stays and the slashing one goes on to and fro.
"""

import numpy as np
from numpy.typing import NDArray

from shared.game.geometry import dot
from shared.policy.scripted.blades import turned, unit
from shared.policy.scripted.memory import Bools, Remembering
from shared.policy.scripted.sight import OWN, Sight, is_in_target, is_touching
from shared.policy.scripted.tracking import track

Floats = NDArray[np.float64]
Float32s = NDArray[np.float32]

STABS: Floats = unit(
    np.array([[0.80, 0.00, 0.60], [0.75, 0.50, 0.43], [0.75, 0.66, 0.00], [0.85, -0.20, 0.48]]).T
)
"""Directions of the blade in a stab, one a column: from below, from below right, from the right,
from below left; all within reach of the right arm, the default one."""
DEPTH = 0.62
"""Of the blade, from the grip, that points at the target's centre in a stab (m)."""
DRAWN_BACK = 0.35
"""How far the blade is drawn back along itself (m)."""
PAUSE = (0.10, 0.50)
"""Seconds that a stab waits, drawn back, before the next; uniform."""
GIVE_UP = 2.5
"""Seconds after which a stab that did not get there is drawn back."""

SLASH_HUB = (-0.50, -0.20, -0.15)
"""The grip of the slashing antagonist (m)."""
SLASH_MIDDLE: Floats = unit(np.array([0.50, 0.20, 0.15]))
"""Its blade in the middle of a stroke: through the target's centre."""
SLASH_ANGLE = 0.75
"""How far a stroke goes to either side of that (rad)."""
SLASH_DONE = 0.15
"""Angle to a stroke's end at which the next one begins (rad)."""
SLASH_LONGEST = 1.2
"""Seconds after which a stroke ends wherever it is."""


class Stab(Remembering):
    """Thrusts into the target, stays while nothing touches, draws back and thrusts again."""

    offset_scale = 1.0

    def act(self, obs: Float32s, generator: np.random.Generator) -> Float32s:
        """Return float32[N, 6]."""
        sight = Sight.of(obs)
        memory, now = self._memory, sight.seconds
        is_new = memory.begin(now)
        if is_new is None:
            memory["stab"] = generator.integers(STABS.shape[1], size=len(obs))
            memory["thrusting"] = np.ones(len(obs), np.bool_)
            memory["until"] = now + GIVE_UP
        elif is_new.any():
            self._choose(is_new, now, generator)
        scoring = is_in_target(sight, OWN, self._arena)
        hit = scoring & is_touching(sight, self._arena)
        thrusting, until = memory["thrusting"], memory["until"]
        is_over = now >= until
        if is_over.any() or hit.any():
            unhurt = scoring & ~hit
            until[thrusting & unhurt & is_over] += GIVE_UP
            back = thrusting & (hit | (is_over & ~unhurt))
            again = ~thrusting & is_over
            thrusting[back] = False
            until[back] = now[back] + generator.uniform(*PAUSE, int(np.count_nonzero(back)))
            if again.any():
                self._choose(again, now, generator)
        blades = STABS[:, memory["stab"]]
        grips = np.where(thrusting, -DEPTH, -DEPTH - DRAWN_BACK) * blades
        return track(sight, grips, blades, self._arena)

    def _choose(self, where: Bools, now: Floats, generator: np.random.Generator) -> None:
        """Begin a stab from a random direction in these worlds."""
        memory = self._memory
        memory["stab"][where] = generator.integers(
            STABS.shape[1], size=int(np.count_nonzero(where))
        )
        memory["thrusting"][where] = True
        memory["until"][where] = now[where] + GIVE_UP


class Slash(Remembering):
    """Swings the blade to and fro through the target, each stroke in a plane of its own."""

    offset_scale = 1.0

    def act(self, obs: Float32s, generator: np.random.Generator) -> Float32s:
        """Return float32[N, 6]."""
        sight = Sight.of(obs)
        memory, now = self._memory, sight.seconds
        is_new = memory.begin(now)
        count = len(obs)
        if is_new is None:
            memory["end"] = np.empty((3, count))
            memory["side"] = np.ones(count)
            memory["until"] = np.empty(count)
            is_new = np.ones(count, np.bool_)
        memory["side"][is_new] = 1.0
        arrived = dot(memory["end"], sight.blades[:, OWN]) > np.cos(SLASH_DONE)
        hit = is_in_target(sight, OWN, self._arena) & is_touching(sight, self._arena)
        turn_round = is_new | arrived | (now >= memory["until"]) | hit
        if turn_round.any():
            self._stroke(turn_round, now, generator)
        hub = np.array(SLASH_HUB)[:, None]
        return track(sight, np.broadcast_to(hub, (3, count)), memory["end"], self._arena)

    def _stroke(self, where: Bools, now: Floats, generator: np.random.Generator) -> None:
        """Begin a stroke to the other side in these worlds, in a new plane."""
        memory = self._memory
        count = int(np.count_nonzero(where))
        side = memory["side"][where] = -memory["side"][where]
        tilt = generator.uniform(-0.5, 0.5, count)
        # A turn about an axis near the vertical, tilted about the blade: strokes from the level
        # to the diagonal.
        axes = np.stack([np.zeros(count), np.sin(tilt), np.cos(tilt)])
        middle = np.broadcast_to(SLASH_MIDDLE[:, None], (3, count))
        memory["end"][:, where] = turned(middle, SLASH_ANGLE * side * axes)
        memory["until"][where] = now[where] + SLASH_LONGEST
