"""Configuration of the page (section ``[page]``)."""

import re

import msgspec

from shared.config.ranges import check_ranges

PERSON = "person"
_ORIGIN = re.compile(r"https?://[A-Za-z0-9.\-\[\]:]+")


class PageConfig(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The page that a person plays on."""

    host: str = "127.0.0.1"
    """Interface it is served on; whoever reaches it can arm the robot, so only this machine."""
    port: int = 8765
    """Of the page; 0 takes any that is free (``page.json`` in the run's folder says which)."""
    origins: tuple[str, ...] = ()
    """Further addresses that the page may be opened under, such as http://lab-pc:8765."""
    pointer: bool = True
    """Whether the mouse is the antagonist's bat; false where another tracker or a policy is."""
    antagonist: str = PERSON
    """Who plays that side: person, or the player that its policy is asked to be."""
    players: tuple[tuple[str, str], ...] = (
        ("Heuristic", "scripted:heuristic"),
        ("Guard", "scripted:guard"),
    )
    """Protagonists to choose from: a name for people and a player; the first one is chosen."""
    is_led: bool = False
    """Whether a study leads: the page names no opponent, and neither arms nor starts anything."""
    max_speed: float = 3.0
    """Of the bat's tip, however fast the mouse is (m/s)."""
    turn_speed: float = 6.0
    """Of the bat about the way it points (rad/s)."""
    countdown: float = 3.0
    """From the click to the bout (s)."""
    rest: float = 15.0
    """After a bout (s); a click ends it."""

    def __post_init__(self) -> None:
        """Check the ranges.

        Raises:
            ValueError: a value is out of its range; says which, and what is allowed.
        """
        if not self.host:
            raise ValueError("host is empty: name an interface, such as 127.0.0.1")
        for origin in self.origins:
            if not _ORIGIN.fullmatch(origin):
                raise ValueError(f"origins has {origin!r}, expected such as http://lab-pc:8765")
        check_ranges(
            self,
            ("port", 0, 65535), ("max_speed", 0.1, 4.0), ("turn_speed", 0.1, 10.0),
            ("countdown", 0.0, 30.0), ("rest", 0.0, 600.0),
        )  # fmt: skip
        names = [name for name, _ in self.players]
        if not names or len(set(names)) != len(names) or not all(map(all, self.players)):
            raise ValueError(
                "players needs at least one pair of a name, unlike others, and a player"
            )
        if not self.antagonist:
            raise ValueError("antagonist is empty: person, or a player such as scripted:stab")
        if self.pointer and self.antagonist != PERSON:
            raise ValueError(
                f"pointer is on and antagonist is {self.antagonist!r}: whoever has the mouse is a "
                "person, so turn one of them off"
            )
