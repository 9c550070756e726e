"""The one observation encoder, for simulation and robot alike (paper: 27 numbers).

Both bats are described in the *arena frame* of the observing side: origin at the target's centre,
x from the own side towards the other, z up. So both sides see the game alike. Poses, linear and
angular velocities turn into that frame by one linear map, which makes the encoder one product.
"""

import numpy as np
from numpy.typing import NDArray

from shared.messages.training import OBS_DIM
from shared.policy.schema import schema_hash

Floats = NDArray[np.float64]
Observations = NDArray[np.float32]

BAT_DIM = 13
"""Position (3, m), orientation (4, w x y z), linear (3, m/s) and angular velocity (3, rad/s)."""

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
    """Turns two bat states and the time into what one side's policy sees."""

    def __init__(self, centre: tuple[float, float, float], yaw: float) -> None:
        """Prepare the map.

        Args:
            centre: of the target, in the frame the bats are tracked in (m).
            yaw: heading of the observing side in that frame (rad): 0 looks along +x.
        """
        cosine, sine = np.cos(yaw), np.sin(yaw)
        turn = np.array([[cosine, sine, 0.0], [-sine, cosine, 0.0], [0.0, 0.0, 1.0]])
        half = np.array([np.cos(yaw / 2), 0.0, 0.0, -np.sin(yaw / 2)])
        bat = np.zeros((BAT_DIM, BAT_DIM))
        bat[0:3, 0:3] = turn
        bat[3:7, 3:7] = _quaternion_product_matrix(half)
        bat[7:10, 7:10] = turn
        bat[10:13, 10:13] = turn
        bat[np.abs(bat) < 1e-12] = 0.0
        self._map_transposed = np.ascontiguousarray(bat.T)
        self._shift = np.zeros(BAT_DIM)
        self._shift[0:3] = -turn @ np.asarray(centre)

    def encode(
        self, own: Floats, other: Floats, seconds: Floats, out: Observations | None = None
    ) -> Observations:
        """Return what the side sees.

        Args:
            own: float64[N, 13], state of the own bat in the tracking frame.
            other: float64[N, 13], state of the other bat.
            seconds: float64[N], game time.
            out: float32[N, 27] to write into; a new array without it.

        Returns:
            float32[N, 27].
        """
        if out is None:
            out = np.empty((len(own), OBS_DIM), np.float32)
        for bat, start, reference in (
            (own, 0, OWN_REFERENCE),
            (other, BAT_DIM, OTHER_REFERENCE),
        ):
            turned = bat @ self._map_transposed
            turned += self._shift
            quaternion = turned[:, 3:7]
            quaternion *= np.copysign(1.0, quaternion @ reference)[:, None]
            out[:, start : start + BAT_DIM] = turned
        out[:, 2 * BAT_DIM] = seconds
        return out
