"""A guard that does not camp: its blade bars the way into the target from outside.

It aims at the point where the opponent's blade enters (or would enter) a sphere somewhat wider
than the target, and lays its own blade through that point along a line that touches, and does not
cut, a sphere that is still wider than the target. So it meets the opponent's blade without being
in the target itself.
"""

import numpy as np
from numpy.typing import NDArray

from shared.game.geometry import BatShape, dot, length
from shared.policy.scripted.blades import across, tangent_back
from shared.policy.scripted.memory import Remembering
from shared.policy.scripted.retreat import Retreat
from shared.policy.scripted.sight import OTHER, OWN, Arena, Sight, nearest_to_centre
from shared.policy.scripted.tracking import track

Floats = NDArray[np.float64]
Float32s = NDArray[np.float32]

CLEARANCE = 0.05
"""Between the target and the guard's blade at its nearest (m)."""
MEETING = 0.15
"""Between the target and the point where blades should meet (m)."""
TIP = 0.06
"""How far from its tip the guard's blade meets the other (m)."""
PATIENCE_STEPS = 50
"""Consecutive steps in the target after which it draws back, whatever it costs."""
HOME: Floats = np.array([[-0.45], [-0.25], [-0.10]])
"""Where the hand is en garde (m)."""
_TINY = 1e-9
_RIGHT_AND_UP: Floats = np.array([0.0, -1.0, 0.5])


def meeting_point(grips: Floats, blades: Floats, bat: BatShape, radius: float) -> Floats:
    """Return where the opponents' blades come in through a sphere around the target.

    A blade that does not reach the sphere is met on the sphere, where it is nearest to it.

    Args:
        grips: float64[3, N], the opponents' (m).
        blades: float64[3, N], unit vectors.
        bat: shape of the bats.
        radius: of the sphere (m).
    """
    nearest = nearest_to_centre(grips, blades, bat)
    distance = length(nearest)
    # Towards the grip from the nearest point until the blade leaves the sphere.
    ahead = dot(nearest, blades)
    back = ahead + np.sqrt(np.maximum(ahead * ahead + radius * radius - distance * distance, 0.0))
    outside = nearest * (radius / np.maximum(distance, _TINY))
    return np.where(distance < radius, nearest - back * blades, outside)


class Guard(Remembering):
    """Bars the way from outside the target."""

    offset_scale = 1.0

    def __init__(self, arena: Arena) -> None:
        super().__init__(arena)
        self._retreat = Retreat(self._memory, arena, PATIENCE_STEPS)

    def desired(self, sight: Sight) -> tuple[Floats, Floats]:
        """Return where the grips (m) and unit vectors along the blades should be."""
        arena = self._arena
        near, far = arena.reach_of_target + CLEARANCE, arena.reach_of_target + MEETING
        points = meeting_point(sight.grips[:, OTHER], sight.blades[:, OTHER], arena.bat, far)
        outward = points / far
        # Past the target on the side where the own hand is and has its home.
        sideways = across(sight.grips[:, OWN] + HOME, outward, _RIGHT_AND_UP)
        back = tangent_back(outward, far, near, sideways)
        return points + (arena.bat.front - TIP) * back, -back

    def act(self, obs: Float32s, generator: np.random.Generator) -> Float32s:
        """Return float32[N, 6]."""
        sight = Sight.of(obs)
        is_new = self._memory.begin(sight.seconds)
        wanted = self._retreat.apply(is_new, sight, *self.desired(sight))
        return track(sight, *wanted, self._arena)
