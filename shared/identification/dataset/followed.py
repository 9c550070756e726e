"""Whether joints follow their commands, or what was recorded is mixed up."""

from collections.abc import Mapping
from typing import Final

import numpy as np

from shared.identification.dataset.types import Caveat, Float64

_MOVES: Final = 0.01
"""Standard deviation of what moves at all (rad, m)."""
_FOLLOWS: Final = 0.95
"""Correlation of where a joint is with where it is sent, if it surely goes there."""
_FOLLOWS_NOT: Final = 0.5
"""The same, if it surely does not."""
_AS_FAR: Final = 0.7
"""Of the way of a command, that a joint goes at least which follows it; and the other way round."""
MIXED_UP: Final = ("other_way", "other_joint", "follows_none", "like_positions")
"""Caveats of data that is hardly what was recorded."""


def of_commands(name: str, sent: Mapping[str, Float64], got: Mapping[str, Float64]) -> list[Caveat]:
    """Return what is strange of where joints go, beside where they are sent.

    Args:
        name: of the recording.
        sent: float64[T] of each joint, the position in force at each reading.
        got: float64[T] of each joint, what was read.
    """
    found: list[Caveat] = []
    likes = {joint: _likeness(own, got[joint]) for joint, own in sent.items()}
    for joint, like in likes.items():
        if like < -_FOLLOWS:
            found.append(Caveat("other_way", name, (
                f"joint {joint!r} goes the other way than its command (correlation "
                f"{like:.2f}): turn the sign of one of them round, or of the joint's axis in the "
                "model file, unless its actuator has a negative gear"
            )))  # fmt: skip
            continue
        if like >= _FOLLOWS_NOT:
            continue
        others = {each: _likeness(sent[each], got[joint]) for each in sent if each != joint}
        other = max(others, key=lambda each: others[each], default=joint)
        if other != joint and _follows(got[joint], sent[other]):
            found.append(Caveat("other_joint", name, (
                f"joint {joint!r} follows the command of {other!r} (correlation "
                f"{others[other]:.2f}) and not its own ({like:.2f}): see whether their columns are "
                "mixed up"
            )))  # fmt: skip
    most = max((abs(likes[joint]) for joint in likes if _moves(got[joint])), default=1.0)
    if most < _FOLLOWS_NOT and not found:
        found.append(Caveat("follows_none", name, (
            "no joint goes where its command says (the largest correlation is "
            f'{most:.2f}): write control = "torque" if these are torques, and see whether '
            "commands and readings are of one recording and one clock"
        )))  # fmt: skip
    return found


def of_torques(name: str, sent: Mapping[str, Float64], got: Mapping[str, Float64]) -> list[Caveat]:
    """Return ``like_positions`` where torques are where joints go, as no torques are.

    Args:
        name: of the recording.
        sent: float64[T] of each actuator, the torque in force at each reading.
        got: float64[T] of each joint, what was read.
    """
    moving = {each: torque for each, torque in sent.items() if _moves(torque)}
    like = [any(_follows(each, torque) for each in got.values()) for torque in moving.values()]
    if not moving or not all(like):
        return []
    return [Caveat("like_positions", name, (
        f"the torques of {', '.join(moving)} go with the joints, and as far: write "
        'control = "position" if these are positions that servos hold'
    ))]  # fmt: skip


def _moves(series: Float64) -> bool:
    return float(series.std()) >= _MOVES


def _follows(reading: Float64, command: Float64) -> bool:
    """Return whether a joint surely goes where a command says, and about as far."""
    sizes = float(command.std()), float(reading.std())
    return _likeness(command, reading) > _FOLLOWS and min(sizes) > _AS_FAR * max(sizes)


def _likeness(one: Float64, other: Float64) -> float:
    """Return the correlation of two series; 0 where one hardly moves."""
    if not (_moves(one) and _moves(other)):
        return 0.0
    first, second = one - one.mean(), other - other.mean()
    return float(first @ second / (np.linalg.norm(first) * np.linalg.norm(second)))
