"""The paper's scoring rule (algorithm "The Fencing Game Scoring Mechanism"), one step at a time.

The prose of the paper pays the camping rule once when the protagonist has waited in the target
for two seconds; its algorithm pays on every step past 200. ``camping="every_step"`` is the
algorithm and the default, ``camping="once"`` pays on the first step past each further 200.
"""

from typing import Literal

import msgspec
import numpy as np
from numpy.typing import NDArray

Bools = NDArray[np.bool_]
Ints = NDArray[np.int32]
Floats = NDArray[np.float64]


class RuleBook(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The numbers of the game (section ``[game]`` of a site file)."""

    point: float = 1.0
    """The antagonist's points for a step with the bat in the target and no contact."""
    penalty: float = -10.0
    """The antagonist's points for a step with the bat in the target and the bats touching."""
    camping_award: float = 10.0
    """The antagonist's points when the protagonist's bat has been in the target too long."""
    camping_steps: int = 200
    """Consecutive steps the protagonist's bat may be in the target for free."""
    camping: Literal["every_step", "once"] = "every_step"
    """Pay on every step past ``camping_steps``, or once per ``camping_steps``."""
    bout_steps: int = 2000
    """Control steps of a bout: 20 s at 10 ms."""

    def __post_init__(self) -> None:
        """Check the ranges."""
        for name in ("camping_steps", "bout_steps"):
            if getattr(self, name) < 1:
                raise ValueError(f"{name} ({getattr(self, name)}) must be at least 1")


def count_camping(camping: Ints, protagonist_in_target: Bools) -> Ints:
    """Return how many consecutive steps, this one included, each protagonist was in the target.

    Args:
        camping: int32[N], the count up to the step before.
        protagonist_in_target: bool[N].

    Returns:
        int32[N].
    """
    return (camping + 1) * protagonist_in_target


def is_camping_paid(camping: Ints, rules: RuleBook) -> Bools:
    """Return bool[N], whether this step pays the camping award.

    Args:
        camping: int32[N], consecutive steps in the target, this one included.
        rules: the rule book.
    """
    too_long = camping > rules.camping_steps
    if rules.camping == "every_step":
        return too_long
    return too_long & ((camping - 1) % rules.camping_steps == 0)


def attack_points(antagonist_in_target: Bools, contact: Bools, rules: RuleBook) -> Floats:
    """Return what attacking pays the antagonist in one 10 ms step of each of N bouts.

    Args:
        antagonist_in_target: bool[N], the antagonist's bat reaches into the target.
        contact: bool[N], the two bats touch.
        rules: the rule book.

    Returns:
        float64[N].
    """
    return np.where(contact, rules.penalty, rules.point) * antagonist_in_target


def camping_points(camping: Ints, rules: RuleBook) -> Floats:
    """Return what the protagonist's camping pays the antagonist in one step of each of N bouts.

    Args:
        camping: int32[N], consecutive steps the protagonist's bat has been in the target.
        rules: the rule book.

    Returns:
        float64[N].
    """
    points: Floats = rules.camping_award * is_camping_paid(camping, rules).astype(np.float64)
    return points
