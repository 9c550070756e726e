"""Configuration of an actor (section ``[actor]``)."""

import msgspec

from shared.messages.training import MOST_WORLDS
from shared.sim.worlds import Backend


class ActorConfig(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """How many bouts one actor plays at once, and how it hands them over."""

    num_envs: int = 128
    """Bouts played in parallel."""
    rollout_steps: int = 40
    """Control steps of one rollout; a divisor of the bout's 2000."""
    opponent_cache: int = 16
    """Opponents kept in memory, by hash."""
    ask_timeout: float = 5.0
    """Seconds to wait for an answer of the league."""
    acknowledge_timeout: float = 60.0
    """Seconds to wait for a rollout to be acknowledged before it is sent again."""
    frame_period: float = 4.0
    """Seconds of wall clock between two sampled stretches of a bout for viewers; 0 sends none."""
    frame_steps: int = 4
    """Control steps between two frames of a stretch."""
    backend: Backend = "cpu"
    """What steps the physics: MuJoCo on the processor, or mujoco_warp on a graphics card."""
    device: str = ""
    """Of ``warp``: ``cuda:0``; empty takes the first card."""

    def __post_init__(self) -> None:
        """Check the ranges."""
        for name in ("num_envs", "rollout_steps", "opponent_cache", "frame_steps"):
            if getattr(self, name) < 1:
                raise ValueError(f"{name} ({getattr(self, name)}) must be at least 1")
        if self.num_envs > MOST_WORLDS:
            raise ValueError(f"num_envs ({self.num_envs}) must be at most {MOST_WORLDS}")
        for name in ("ask_timeout", "acknowledge_timeout"):
            if getattr(self, name) <= 0.0:
                raise ValueError(f"{name} ({getattr(self, name)} s) must be positive")
