"""What a scripted player knows of the game, and an observation read component first."""

import dataclasses

import numpy as np
from numpy.typing import NDArray

from shared.game.geometry import (
    BatShape,
    Target,
    blade_direction,
    distance_between_bats,
    dot,
)
from shared.policy.action import ActionConfig
from shared.policy.observation import BAT_DIM

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]
Float32s = NDArray[np.float32]

OWN, OTHER = 0, 1
"""Places of the two bats in a sight."""


@dataclasses.dataclass(frozen=True)
class Arena:
    """The sizes of the game; the defaults are those of ``riposte train``."""

    bat: BatShape = dataclasses.field(default_factory=BatShape)
    """Shape of both bats."""
    target_radius: float = Target.radius
    """Radius of the target (m)."""
    offset_bound_m: float = ActionConfig().offset_bound_m
    offset_bound_rad: float = ActionConfig().offset_bound_rad
    """Bounds that the player's actions are in units of (m, rad)."""
    control_timestep: float = 0.01
    """Time between two observations (s)."""

    @property
    def reach_of_target(self) -> float:
        """Return how near a blade's axis is to the centre when its surface touches the target."""
        return self.target_radius + self.bat.radius

    def with_bounds_scaled(self, factor: float) -> "Arena":
        """Return the same game with bounds so many times as wide."""
        return dataclasses.replace(
            self,
            offset_bound_m=factor * self.offset_bound_m,
            offset_bound_rad=factor * self.offset_bound_rad,
        )

    @property
    def middle(self) -> float:
        """Return where the bat's middle is on its blade, from the grip (m)."""
        return 0.5 * (self.bat.back + self.bat.front)

    @property
    def bat_length(self) -> float:
        """Return the length of a bat's axis (m)."""
        return self.bat.front - self.bat.back


@dataclasses.dataclass(frozen=True)
class Sight:
    """One observation of N worlds; the own bat first wherever there are two."""

    grips: Floats
    """float64[3, 2, N], origins of the bat frames (m)."""
    blades: Floats
    """float64[3, 2, N], unit vectors along the blades."""
    velocities: Floats
    """float64[3, 2, N], of the grips (m/s)."""
    turning: Floats
    """float64[3, 2, N], angular velocities (rad/s)."""
    seconds: Floats
    """float64[N], game time."""

    @staticmethod
    def of(obs: Float32s) -> "Sight":
        """Read float32[N, 27]."""
        rows = obs.T.astype(np.float64, order="C")
        bats = rows[: 2 * BAT_DIM].reshape(2, BAT_DIM, -1).swapaxes(0, 1)
        return Sight(bats[0:3], blade_direction(bats[3:7]), bats[7:10], bats[10:13], rows[-1])


def nearest_to_centre(grips: Floats, blades: Floats, bat: BatShape) -> Floats:
    """Return the points of the bats' axes that are nearest to the target's centre.

    Args:
        grips: float64[3, ...], origins of the bat frames.
        blades: float64[3, ...], unit vectors along the blades.
        bat: shape of the bats.
    """
    along = np.minimum(np.maximum(-dot(grips, blades), bat.back), bat.front)
    return grips + along * blades


def is_in_target(sight: Sight, who: int, arena: Arena) -> Bools:
    """Return bool[N], whether a bat is in the target; ``who`` is ``OWN`` or ``OTHER``."""
    nearest = nearest_to_centre(sight.grips[:, who], sight.blades[:, who], arena.bat)
    return dot(nearest, nearest) <= arena.reach_of_target**2


def is_touching(sight: Sight, arena: Arena) -> Bools:
    """Return bool[N], whether the two bats touch."""
    grips, blades = sight.grips, sight.blades
    between = distance_between_bats(
        grips[:, OWN], blades[:, OWN], grips[:, OTHER], blades[:, OTHER], arena.bat
    )
    return between <= 0.0
