"""Settings of `riposte play`: section ``[play]`` of a site file."""

import msgspec


class PlayConfig(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Who plays a match, and how many bouts."""

    protagonist: str = ""
    """The robot's player: heuristic, scripted:NAME, a player of the bundle (style-1), the file of
    a snapshot, RUN:protagonist or sha256:HASH; empty takes the first selected one of the bundle."""
    antagonist: str = ""
    """Who plays against it: mouse, vive or replay (a bat that is tracked), or heuristic,
    scripted:NAME, a file, RUN:antagonist or sha256:HASH (a second simulated robot); empty takes
    the tracker of robot_io, or the mouse where that is a policy."""
    bouts: int = 0
    """Bouts to play; 0 goes on until it is stopped."""
    rest: float = 5.0
    """From the end of a bout to the next, where `riposte play` starts them (s)."""
    patience: float = 300.0
    """A match that waits for a person longer than this ends (s)."""
    record: bool = True
    """Run a recorder: the live view, recording.rrd and the archive of the bouts."""

    def __post_init__(self) -> None:
        """Check the ranges."""
        if not 0 <= self.bouts <= 10_000:
            raise ValueError(f"bouts ({self.bouts}) must be in 0 .. 10000")
        if not 0.0 <= self.rest <= 600.0:
            raise ValueError(f"rest ({self.rest} s) must be in [0, 600]")
        if not 1.0 <= self.patience <= 86_400.0:
            raise ValueError(f"patience ({self.patience} s) must be in [1, 86400]")
