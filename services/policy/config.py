"""Configuration of the policies (section ``[policy]``)."""

import re

import msgspec


class PolicyConfig(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Who plays a live bout, where no person does."""

    antagonist: str = "scripted:stab"
    """Player of that side: scripted:NAME, the file of a snapshot, RUN:antagonist for the newest of
    a run's folder, or sha256:HASH for one in the folder of this run."""
    protagonist: str = "scripted:heuristic"
    """Player of that side, named alike."""
    model: str = ""
    """Hash of the simulator model that snapshots must be trained in; empty takes any."""
    stale_after: float = 0.1
    """States older than this by the clock are not answered (s)."""
    referee_silence: float = 0.5
    """A bout that the referee says nothing of for longer is not played on (s)."""
    seed: int = 0
    """Of players that draw numbers."""

    def __post_init__(self) -> None:
        """Check the ranges."""
        for name in ("antagonist", "protagonist"):
            if not getattr(self, name):
                raise ValueError(f"{name} is empty: name a player, such as scripted:static")
        if not re.fullmatch(r"[0-9a-f]{64}|", self.model):
            raise ValueError(f"model ({self.model!r}) must be 64 hex digits, or empty")
        if not 0.01 <= self.stale_after <= 1.0:
            raise ValueError(f"stale_after ({self.stale_after} s) must be in [0.01, 1]")
        if not 0.05 <= self.referee_silence <= 5.0:
            raise ValueError(f"referee_silence ({self.referee_silence} s) must be in [0.05, 5]")
        if self.seed < 0:
            raise ValueError(f"seed ({self.seed}) must not be negative")
