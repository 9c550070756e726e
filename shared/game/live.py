"""What a live bout adds to the scoreboard: tracked bats in, a verdict and a tone out."""

import numpy as np
from numpy.typing import NDArray

from shared.game.bout import Judgement, Scoreboard

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

SCORING_HZ = 440.0
"""Tone while the antagonist's bat is in the target and scores (the paper's)."""
PENALTY_HZ = 300.0
"""Tone while it is there and the bats touch."""
SILENCE_HZ = 0.0
QUATERNION_LENGTHS = (0.99, 1.01)
"""Shortest and longest orientation that is taken for one."""
LARGEST = 1000.0
"""No number of a bat's state is larger: position (m), velocity (m/s), turning (rad/s)."""

_POSE_DIM = 7
_ORIENTATION = slice(3, _POSE_DIM)


def judge_states(scores: Scoreboard, bats: Floats) -> Judgement:
    """Score one step of N bouts from bat states as they are tracked and sent.

    Args:
        scores: of the N bouts.
        bats: float64[N, 2, 13], antagonist first: position (m), orientation (w x y z), linear
            and angular velocity, in the world frame.
    """
    poses = np.ascontiguousarray(bats[:, :, :_POSE_DIM].transpose(2, 1, 0))
    return scores.judge(poses[:3], poses[3:])


def is_sound(bats: Floats) -> Bools:
    """Return bool[...], whether these bat states can be judged and acted on at all.

    Args:
        bats: float64[..., 13].
    """
    shortest, longest = QUATERNION_LENGTHS
    with np.errstate(invalid="ignore", over="ignore"):
        lengths = np.sqrt(np.square(bats[..., _ORIENTATION]).sum(axis=-1))
        is_small = (np.abs(bats) <= LARGEST).all(axis=-1)  # not so where it is NaN
        return is_small & (lengths >= shortest) & (lengths <= longest)


def tone_of(in_target: bool, contact: bool) -> float:
    """Return the tone (Hz) of a step: the target is invisible, and found by ear.

    Camping makes no sound: a tone always means that the antagonist's bat is in the target.
    """
    if not in_target:
        return SILENCE_HZ
    return PENALTY_HZ if contact else SCORING_HZ
