"""Turns the pose that a bat should take into an action.

An action moves and turns the *tool* in the *torso* frame; a player sees its *bat* in the *arena*
frame. For a player that makes no difference: the grip is the tool's origin, both frames have the
axes of the robot's heading (they differ by a shift alone), and a turn applied from the left turns
tool and bat alike. So an error seen in the arena frame is an offset in the torso frame, unchanged
(tested against the simulator with both robots and both arms).
"""

import numpy as np
from numpy.typing import NDArray

from shared.messages.training import ACTION_DIM
from shared.policy.scripted.blades import gibbs_between
from shared.policy.scripted.sight import OWN, Arena, Sight

Floats = NDArray[np.float64]
Float32s = NDArray[np.float32]

DAMPING_SECONDS = 0.03
"""How far ahead the bat's own motion is reckoned with: calms what the servo would overshoot."""


def track(
    sight: Sight,
    grips: Floats,
    blades: Floats,
    arena: Arena,
    damping: float = DAMPING_SECONDS,
) -> Float32s:
    """Return float32[N, 6], the actions that bring the own bats to these poses.

    The roll about a blade is left as it is: a bat looks the same from all sides.

    Args:
        sight: what is seen now.
        grips: float64[3, N], where the grips should be (m).
        blades: float64[3, N], unit vectors the blades should point along.
        arena: gives the bounds that actions are in units of.
        damping: seconds of the bat's motion that are subtracted.
    """
    out = np.empty((ACTION_DIM, sight.grips.shape[-1]))
    reach = grips - sight.grips[:, OWN] - damping * sight.velocities[:, OWN]
    np.divide(reach, arena.offset_bound_m, out=out[:3])
    turn = gibbs_between(sight.blades[:, OWN], blades) - damping * sight.turning[:, OWN]
    np.divide(turn, arena.offset_bound_rad, out=out[3:])
    return out.T.astype(np.float32)
