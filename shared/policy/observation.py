"""The one observation encoder, for simulation and robot alike (paper: 27 numbers).

Both bats are described in the *arena frame* of the observing side: origin at the target's centre,
x from the own side towards the other, z up. So both sides see the game alike. Poses, linear and
angular velocities turn into that frame by one linear map, which makes the encoder one product.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from shared.policy.schema import schema_hash

Floats = NDArray[np.float64]
Observations = NDArray[np.float32]

BAT_DIM = 13
"""Position (3, m), orientation (4, w x y z), linear (3, m/s) and angular velocity (3, rad/s)."""
_QUATERNION = 3
"""Where the orientation stands in a bat's state."""

OWN_REFERENCE = (0.58, 0.55, -0.33, 0.49)
OTHER_REFERENCE = (0.49, -0.33, -0.55, -0.58)
"""Orientations about which q and -q are told apart: the bats in the en-garde pose."""

OBSERVATION_SCHEMA = schema_hash(
    {
        "frame": "origin target centre, x own side to other side, z up",
        "fields": [
            f"{who}.{what}"
            for who in ("own", "other")
            for what in ("position[3]", "quaternion_wxyz[4]", "velocity[3]", "angular_velocity[3]")
        ]
        + ["time_s"],
        "hemisphere": [OWN_REFERENCE, OTHER_REFERENCE],
    }
)


def _quaternion_product_matrix(q: Floats) -> Floats:
    """Return float64[4, 4], the matrix of p -> q p for unit quaternions w x y z."""
    w, x, y, z = q
    return np.array([[w, -x, -y, -z], [x, w, -z, y], [y, z, w, -x], [z, -y, x, w]])


class ObservationEncoder:
    """Turns two bat states and the time into what each of several observers sees.

    Every number but the time is linear in the bats' states, up to the sign of the quaternions;
    so are the four products that decide those signs. One matrix product gives all of them.
    """

    def __init__(self, centre: tuple[float, float, float], yaws: Sequence[float]) -> None:
        """Prepare the map.

        Args:
            centre: of the target, in the frame the bats are tracked in (m).
            yaws: heading of each observing side in that frame (rad), 0 looks along +x; observer
                0 owns bat 0, observer 1 bat 1.
        """
        blocks: list[Floats] = []
        shifts: list[Floats] = []
        for own, yaw in enumerate(yaws):
            turn, shift = _turn_and_shift(np.asarray(centre), yaw)
            other = 1 - own
            block = np.zeros((2 * BAT_DIM, 2 * BAT_DIM))
            block[own * BAT_DIM : (own + 1) * BAT_DIM, :BAT_DIM] = turn
            block[other * BAT_DIM : (other + 1) * BAT_DIM, BAT_DIM:] = turn
            blocks.append(block)
            shifts.append(np.concatenate([shift, shift]))
        self._observers = len(yaws)
        columns = np.concatenate(blocks, axis=1)
        starts = 2 * BAT_DIM * np.arange(self._observers)[:, None] + np.array(
            [_QUATERNION, BAT_DIM + _QUATERNION]
        )
        signs = [
            columns[:, start : start + 4] @ reference
            for start, reference in zip(
                starts.ravel(), [OWN_REFERENCE, OTHER_REFERENCE] * self._observers, strict=True
            )
        ]
        self._map = np.concatenate([columns, np.stack(signs, axis=1)], axis=1).astype(np.float32)
        self._shift = np.concatenate(shifts).astype(np.float32)

    def encode(self, bats: Floats, seconds: Floats, outs: Sequence[Observations]) -> None:
        """Write what each observer sees.

        Args:
            bats: float64[N, 26], the states of bat 0 and bat 1 in the tracking frame: position,
                orientation (w x y z), linear and angular velocity.
            seconds: float64[N], game time.
            outs: float32[N, 27] for each observer.
        """
        width = 2 * BAT_DIM
        split = self._observers * width
        mapped = bats.astype(np.float32) @ self._map
        numbers, products = mapped[:, :split], mapped[:, split:]
        numbers += self._shift
        quaternions = numbers.reshape(len(bats), -1, BAT_DIM)[:, :, _QUATERNION : _QUATERNION + 4]
        quaternions *= np.copysign(np.float32(1.0), products)[:, :, None]
        for observer, out in enumerate(outs):
            out[:, :width] = numbers[:, observer * width : (observer + 1) * width]
            out[:, width] = seconds


def _turn_and_shift(centre: Floats, yaw: float) -> tuple[Floats, Floats]:
    """Return float64[13, 13] and float64[13]: bat state (a row) into the arena frame of a side."""
    cosine, sine = np.cos(yaw), np.sin(yaw)
    turn = np.array([[cosine, sine, 0.0], [-sine, cosine, 0.0], [0.0, 0.0, 1.0]])
    half = np.array([np.cos(yaw / 2), 0.0, 0.0, -np.sin(yaw / 2)])
    bat = np.zeros((BAT_DIM, BAT_DIM))
    bat[0:3, 0:3] = turn
    bat[3:7, 3:7] = _quaternion_product_matrix(half)
    bat[7:10, 7:10] = turn
    bat[10:13, 10:13] = turn
    bat[np.abs(bat) < 1e-12] = 0.0
    shift = np.zeros(BAT_DIM)
    shift[0:3] = -turn @ centre
    return bat.T, shift
