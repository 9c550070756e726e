"""What is asked for: which arm, which motion, what is to be hidden in it."""

import re
from dataclasses import dataclass, field
from typing import Final

from shared.config.site import nearest
from shared.errors import IdentificationError
from shared.identification.hidden.noise import NoiseLevels
from shared.sim.hidden.arms import ARMS, ArmName
from shared.sim.hidden.effect import hidden_effects

_WISH: Final = re.compile(r"(?P<name>[^@=]+)(@(?P<place>[^=]*))?(=(?P<size>.*))?\Z")
SHARES: Final = (0.02, 0.95)
"""Of the residual that an effect drawn at random makes."""


@dataclass(frozen=True)
class Wish:
    """An effect to hide; what is None is drawn."""

    name: str
    place: str | None = None
    size: float | None = None


@dataclass(frozen=True)
class Recipe:
    """One data set."""

    arm: ArmName = "pr2"
    wishes: tuple[Wish, ...] = ()
    random: int = 0
    """How many more effects are drawn; all of them different."""
    without: frozenset[str] = frozenset()
    """Effects that are not drawn."""
    is_imperfect: bool = False
    """Links weigh up to 10 % more or less, and the physics' step is finer still."""
    is_gentle: bool = False
    """A person moves the arm slowly, where motion is designed otherwise."""
    has_tracker: bool = True
    seed: int = 0
    reach: float = 1.0
    """How far motion goes, as a share of what the arm may; a small one shows one posture only."""
    seconds: float = 6.0
    train: int = 3
    test: int = 2
    spread: float = 0.15
    """Standard deviation of the logarithm of each base parameter's factor."""
    shares: tuple[float, float] = SHARES
    has_shares: bool = True
    """Whether it is measured how much effects of a given size show; takes longer."""
    noise: NoiseLevels = field(default_factory=NoiseLevels)

    def __post_init__(self) -> None:
        """Refuse what cannot be made."""
        for name, value, low, high in (
            ("seconds", self.seconds, 2.0, 600.0),
            ("reach", self.reach, 0.01, 1.0),
            ("train trajectories", self.train, 1, 30),
            ("test trajectories", self.test, 1, 30),
            ("random effects", self.random, 0, 5),
            ("seed", self.seed, 0, 2**31 - 1),
        ):
            if not low <= value <= high:
                raise IdentificationError(
                    f"{name} must be between {low:g} and {high:g}, got {value:g}"
                )
        if self.arm not in ARMS:
            raise IdentificationError(f"there is no arm {self.arm!r}; {nearest(self.arm, ARMS)}")
        for wish in self.wishes:
            _check(wish)

    @property
    def timestep(self) -> float:
        """Return the step of the robot's own physics (s)."""
        return 0.5e-3 if self.is_imperfect else 1e-3


def wish_of(text: str) -> Wish:
    """Return what ``NAME[@PLACE][=SIZE]`` asks for.

    Raises:
        IdentificationError: it is no such text, or there is no such effect.
    """
    match = _WISH.match(text)
    if match is None:
        raise IdentificationError(f"{text!r} is no effect: write NAME, NAME@PLACE or NAME=SIZE")
    size = None
    if match["size"] is not None:
        try:
            size = float(match["size"])
        except ValueError:
            raise IdentificationError(
                f"{text!r}: {match['size']!r} is no number; write NAME=SIZE as payload=0.3"
            ) from None
    wish = Wish(match["name"], match["place"], size)
    _check(wish)
    return wish


def _check(wish: Wish) -> None:
    known = hidden_effects()
    if wish.name not in known:
        raise IdentificationError(
            f"cannot hide {wish.name!r}; {nearest(wish.name, known)}. "
            f"These can be hidden: {', '.join(known)}"
        )
