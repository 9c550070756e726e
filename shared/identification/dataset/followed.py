"""Whether joints follow their commands, or what was recorded is mixed up."""

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np

from shared.identification.dataset.types import Caveat, Float64

_MOVES: Final = 0.01
"""Standard deviation of what moves at all (rad, m)."""
_FOLLOWS: Final = 0.95
"""Correlation of where a joint is with where it is sent, if it surely goes there."""
_FOLLOWS_NOT: Final = 0.5
"""The same, if it surely does not."""
_LATE: Final = 0.5
"""How late a joint is that follows its command, at most (s)."""
_LAGS: Final = 20
"""At which that is asked."""
_AS_FAR: Final = 0.7
"""Of the way of a command, that a joint goes at least which follows it; and the other way round."""
_TOO_FAR: Final = 2.0
"""Times as far as its command, or as little, that a joint goes of which it says another number."""
MIXED_UP: Final = ("other_way", "other_joint", "other_scale", "follows_none", "like_positions")
"""Caveats of data that is hardly what was recorded."""


def of_commands(
    name: str, at: Float64, sent: Mapping[str, Float64], got: Mapping[str, Float64]
) -> list[Caveat]:
    """Return what is strange of where joints go, beside where they are sent.

    Args:
        name: of the recording.
        at: float64[T], when that was read (s).
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
        far = float(got[joint].std()) / max(float(sent[joint].std()), 1e-12)
        if like >= _FOLLOWS and not 1.0 / _TOO_FAR < far < _TOO_FAR:
            found.append(Caveat("other_scale", name, (
                f"joint {joint!r} goes as its command does, but {far:.3g} times as far: see "
                "whether both are in rad (m), and of the same side of the gear"
            )))  # fmt: skip
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
    rows = round(_LATE / float(np.median(np.diff(at)))) if len(at) > 1 else 0
    late = [
        _late_likeness(sent[joint], got[joint], rows)
        for joint in likes
        if _moves(got[joint]) and _moves(sent[joint])
    ]
    most = max(late, default=1.0)
    if most < _FOLLOWS_NOT and not found:
        found.append(Caveat("follows_none", name, (
            "no joint goes where its command says (the largest correlation is "
            f'{most:.2f}): write control = "torque" if these are torques, and see whether '
            "commands and readings are of one recording and one clock"
        )))  # fmt: skip
    return found


def among_all(found: Sequence[Caveat], recordings: int) -> list[Caveat]:
    """Return caveats in which what follows nothing in a few recordings is not what commands are.

    Args:
        found: of all recordings.
        recordings: how many there are.
    """
    if 2 * sum(each.name == "follows_none" for each in found) >= recordings:
        return list(found)
    return [
        each
        if each.name != "follows_none"
        else Caveat("follows_little", each.trajectory, (
            "no joint goes where its command says, as they do in other recordings: it is too fast "
            "for them, or commands and readings are not of one recording"
        ))
        for each in found
    ]  # fmt: skip


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


def _late_likeness(command: Float64, reading: Float64, rows: int) -> float:
    """Return the largest correlation with a command, either way, of joints late by some rows."""
    lags = np.unique(np.linspace(0, min(rows, len(reading) // 4), _LAGS).astype(int))
    return max(abs(_likeness(command[: len(command) - lag], reading[lag:])) for lag in lags)


def _likeness(one: Float64, other: Float64) -> float:
    """Return the correlation of two series; 0 where one hardly moves."""
    if not (_moves(one) and _moves(other)):
        return 0.0
    first, second = one - one.mean(), other - other.mean()
    return float(first @ second / (np.linalg.norm(first) * np.linalg.norm(second)))
