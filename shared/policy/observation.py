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
_TIME = 2 * BAT_DIM
_ONE = _TIME + 1
"""Where the time, and a one that carries the shifts, stand behind the bats' states."""

_SEEN = 2 * BAT_DIM + 1
"""How many numbers an observer sees."""
_UNIT = np.float32(1.0)

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

    Every number is linear in the bats' states and the time, up to the sign of the quaternions; so
    are the products that decide those signs. So all of it is matrix products.
    """

    def __init__(self, centre: tuple[float, float, float], yaws: Sequence[float]) -> None:
        """Prepare the map.

        Args:
            centre: of the target, in the frame the bats are tracked in (m).
            yaws: heading of each observing side in that frame (rad), 0 looks along +x; observer
                0 owns bat 0, observer 1 bat 1.
        """
        maps: list[Floats] = []
        products: list[Floats] = []
        for own, yaw in enumerate(yaws):
            turn, shift = _turn_and_shift(np.asarray(centre), yaw)
            seen = np.zeros((2 * BAT_DIM + 2, _SEEN))
            for place, bat in enumerate((own, 1 - own)):
                rows = slice(bat * BAT_DIM, (bat + 1) * BAT_DIM)
                columns = slice(place * BAT_DIM, (place + 1) * BAT_DIM)
                seen[rows, columns] = turn
                seen[_ONE, columns] = shift
            seen[_TIME, -1] = 1.0
            maps.append(seen)
            for place, reference in enumerate((OWN_REFERENCE, OTHER_REFERENCE)):
                start = place * BAT_DIM + _QUATERNION
                products.append(seen[:, start : start + 4] @ reference)
        products.append(np.eye(2 * BAT_DIM + 2)[_ONE])  # the sign of what has none to choose
        self._map = np.hstack([*maps, np.stack(products, axis=1)]).astype(np.float32)
        self._known = np.ones((0, 2 * BAT_DIM + 2), np.float32)
        self._spread = np.hstack([_spread(observer, len(yaws)) for observer in range(len(yaws))])

    def encode(self, bats: Floats, seconds: Floats, outs: Sequence[Observations]) -> None:
        """Write what each observer sees.

        Args:
            bats: float64[N, 26] or [N, 2, 13], the states of bat 0 and bat 1 in the tracking
                frame: position, orientation (w x y z), linear and angular velocity.
            seconds: float64[N], game time.
            outs: float32[N, 27] for each observer.
        """
        if len(bats) != len(self._known):
            self._known = np.ones((len(bats), 2 * BAT_DIM + 2), np.float32)
        known = self._known
        known[:, :_TIME].reshape(-1, 2, BAT_DIM)[:] = bats.reshape(-1, 2, BAT_DIM)
        known[:, _TIME] = seconds
        seen = known @ self._map
        factors = np.copysign(_UNIT, seen[:, len(outs) * _SEEN :]) @ self._spread
        for observer, out in enumerate(outs):
            columns = slice(observer * _SEEN, (observer + 1) * _SEEN)
            np.multiply(seen[:, columns], factors[:, columns], out=out)


def _spread(observer: int, observers: int) -> Observations:
    """Return float32[2 * observers + 1, 27]: signs, a one at their end, to a factor a number."""
    spread = np.zeros((2 * observers + 1, _SEEN), np.float32)
    spread[-1] = 1.0
    for place in range(2):
        start = place * BAT_DIM + _QUATERNION
        spread[:, start : start + 4] = 0.0
        spread[2 * observer + place, start : start + 4] = 1.0
    return spread


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
