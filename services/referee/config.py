"""Configuration of the referee (section ``[referee]``)."""

import msgspec


class RefereeConfig(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """How long a bout may go on without both bats being tracked."""

    stale_after: float = 0.1
    """Without both bats tracked for longer, the bout pauses (s)."""
    void_after: float = 1.0
    """Without both bats tracked for longer, the bout is void (s)."""
    resume_after: float = 0.2
    """So much good tracking starts a bout, and ends a pause made for the lack of it (s)."""

    def __post_init__(self) -> None:
        """Check the ranges."""
        if not 0.02 <= self.stale_after <= 10.0:
            raise ValueError(f"stale_after ({self.stale_after} s) must be in [0.02, 10]")
        if not self.stale_after < self.void_after <= 60.0:
            raise ValueError(
                f"void_after ({self.void_after} s) must be over stale_after "
                f"({self.stale_after} s) and at most 60"
            )
        if not 0.0 <= self.resume_after <= 5.0:
            raise ValueError(f"resume_after ({self.resume_after} s) must be in [0, 5]")
