"""Configuration of a study's session (section ``[study]``)."""

import msgspec

from shared.config.ranges import check_ranges


class StudyConfig(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One participant's session of a study, and its two pages."""

    folder: str = ""
    """Of the study: `riposte study new` makes it."""
    participant: str = ""
    """Whose session it is: sub-01, as in the allocation."""
    antagonist: str = "person"
    """Reference of who plays against the robot, for the record: a person, or a player."""
    players: tuple[tuple[str, str], ...] = ()
    """What the protocol calls a player, and what the policy is told to load for it."""
    host: str = "127.0.0.1"
    """Interface of the pages."""
    port: int = 8770
    """Of the pages; 0 takes any that is free (``study.json`` beside the journal says which)."""
    origins: tuple[str, ...] = ()
    """Further addresses that the pages may be opened under, such as http://lab-pc:8770."""
    countdown: float = 3.0
    """Before a game (s)."""
    score_seconds: float = 5.0
    """How long the score is shown after a game (s)."""
    needs_recorder: bool = True
    """Whether games that count wait for a recorder."""
    has_heart_rate: bool = True
    """Whether a heart-rate sensor is worn; without one, baselines end unmeasured."""
    lsl: bool = False
    """Offer events and heart rate as Lab Streaming Layer streams, to everybody on the network."""

    def __post_init__(self) -> None:
        """Check the ranges.

        Raises:
            ValueError: a value is out of its range; says which, and what is allowed.
        """
        if not self.host:
            raise ValueError("host is empty: name an interface, such as 127.0.0.1")
        check_ranges(
            self, ("port", 0, 65535), ("countdown", 0.0, 30.0), ("score_seconds", 0.0, 60.0)
        )
        names = [name for name, _ in self.players]
        if len(set(names)) != len(names) or not all(map(all, self.players)):
            raise ValueError("players needs pairs of a name, unlike others, and a player")
