"""Which recordings are of one programme: of the same commands."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from shared.identification.dataset.types import Caveat, Control, Float64, Trajectory

ALIKE: Final = 0.05
"""Share of a command's own movement by which two commands differ that are nearly the same."""


def repeats_of(
    trajectories: Sequence[Trajectory], control: Control
) -> tuple[list[Trajectory], list[Caveat]]:
    """Return recordings that repeat only what they do repeat, and ``repeat_differs`` of the others.

    Under torque control they stay repeats: a controller's torques are never quite the same.
    """
    by_name = {each.name: each for each in trajectories}
    kept: list[Trajectory] = []
    found: list[Caveat] = []
    for each in trajectories:
        apart = _apart(by_name[each.repeats], each) if each.repeats else 0.0
        is_other = apart > ALIKE
        if is_other:
            found.append(Caveat("repeat_differs", each.name, (
                f"it should repeat {each.repeats!r}, but its commands differ by {apart:.0%} of "
                "their movement: "
                + ("it may tell of more noise than there is" if control == "torque" else
                   "it tells nothing of the noise, and is taken for a recording of its own")
            )))  # fmt: skip
        kept.append(replace(each, repeats="") if is_other and control != "torque" else each)
    return kept, found


def of_programmes(trajectories: Sequence[Trajectory]) -> list[Caveat]:
    """Return ``one_program`` and ``test_is_train``."""
    found: list[Caveat] = []
    train = [each for each in trajectories if each.split == "train"]
    first = train[0]
    if all(difference(first, each) < ALIKE for each in train[1:]):
        found.append(Caveat("one_program", "", (
            "all train recordings are of one motion: what it does not show is not found; record "
            "different motions"
        )))  # fmt: skip
    for each in trajectories:
        twins = [one.name for one in train if difference(one, each) < ALIKE]
        if each.split == "test" and not each.repeats and twins:
            found.append(Caveat("test_is_train", each.name, (
                f"its commands are those of the train recording {twins[0]!r}: it says little "
                "about other motions; hold out another motion"
            )))  # fmt: skip
    return found


def difference(one: Trajectory, other: Trajectory) -> float:
    """Return how far two commands differ, as a share of their own movement.

    1 or more where their lengths differ by more than a tenth.
    """
    spans = [each.command_at[-1] - each.command_at[0] for each in (one, other)]
    return 1.0 if max(spans) > 1.1 * min(spans) + 0.1 else _apart(one, other)


def _apart(one: Trajectory, other: Trajectory) -> float:
    """Return the same over the shorter of the two, however long the other is.

    Both are read at the same 500 times since their first command.
    """
    shorter = float(min(each.command_at[-1] - each.command_at[0] for each in (one, other)))
    grid = 1e-9 + shorter * np.arange(500) / 499.0
    first, second = [_held(each, each.command_at[0] + grid) for each in (one, other)]
    centre: Float64 = np.mean(first, axis=0)
    movement = float(np.sqrt(np.mean((first - centre) ** 2)))
    apart = float(np.sqrt(np.mean((first - second) ** 2)))
    return apart / movement if movement > 1e-12 else float(apart > 1e-12)


def _held(trajectory: Trajectory, at: Float64) -> Float64:
    """Return the commands in force at some times, none before the first."""
    rows = np.searchsorted(trajectory.command_at, at, side="right") - 1
    return np.take(trajectory.command, rows, axis=0)
