"""Configuration of the simulation: the scene and its time steps."""

from typing import Literal

import msgspec

JointName = Literal[
    "shoulder_pan",
    "shoulder_lift",
    "upper_arm_roll",
    "elbow_flex",
    "forearm_roll",
    "wrist_flex",
    "wrist_roll",
]
Side = Literal["right", "left"]


class SimConfig(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Two PR2 robots facing each other, one bat each, a target between them."""

    model: str = "nominal"
    """A shipped model, or the path of a model.toml."""
    control_timestep: float = 0.01
    """Policy period (s); a whole multiple of physics_timestep."""
    physics_timestep: float = 0.01
    """Step of the integrator (s)."""
    half_distance: float = 1.0
    """From the target's centre to each robot's torso frame along the line between them (m)."""
    torso_lift: float = 0.2
    """How far both torsos are raised (m)."""
    target_height: float = 1.05
    """Height of the target's centre above the floor (m)."""
    target_radius: float = 0.20
    """Radius of the target (m)."""
    arms: tuple[Side, Side] = ("right", "right")
    """The arm that fences: the antagonist's, the protagonist's."""
    bat_arm_contacts: bool = False
    """Whether a bat also hits the opponent's arm (it always hits the opponent's bat)."""

    def __post_init__(self) -> None:
        _between("physics_timestep", self.physics_timestep, 1e-4, 0.02)
        _between("control_timestep", self.control_timestep, 1e-4, 0.1)
        ratio = self.control_timestep / self.physics_timestep
        if round(ratio) < 1 or abs(ratio - round(ratio)) > 1e-9:
            raise ValueError(
                f"control_timestep ({self.control_timestep:g} s) must be a whole multiple of "
                f"physics_timestep ({self.physics_timestep:g} s)"
            )
        _between("half_distance", self.half_distance, 0.6, 2.0)
        _between("torso_lift", self.torso_lift, 0.0, 0.33)
        _between("target_height", self.target_height, 0.2, 2.0)
        _between("target_radius", self.target_radius, 0.01, 0.5)

    @property
    def substeps(self) -> int:
        """Physics steps in one control step."""
        return round(self.control_timestep / self.physics_timestep)


def _between(name: str, value: float, low: float, high: float) -> None:
    if not low <= value <= high:  # also refuses NaN
        raise ValueError(f"{name} must be between {low:g} and {high:g}, got {value:g}")
