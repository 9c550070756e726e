"""Says in words when something is left over: once, after reversals, while fast, ...

A rule is a tree of depth one over what the arm does: inside a range of one quantity the residual's
power is high, outside it is low. The rule that explains most of the logarithm of the power wins.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from shared.identification.dataset.types import Float64
from shared.identification.fitting.problem import BLOCK

THROUGHOUT, ONCE, FROM_THEN, GROWS = "throughout", "once", "from a time on", "grows with time"
AT_TIMES = "at times"
AGAIN = "again and again"
_LONGEST_EVENT = 2.0
"""Of something that happens once (s)."""
_SHORTEST = 0.5
"""Of what is there from a time on, and of what was before (s)."""
_STAYS = 0.7
"""Share of the time after it began in which it has to be there."""
_LATE = 5
"""Blocks by which an arm is off after what pushes it, and that torques are smeared over."""
_MOSTLY = 0.7
"""Share of a missing torque's energy from which it was a push."""
_MANY = 0.8
"""Share of the time from which something is there throughout."""
_FEW = 0.05
"""Share of the time below which it is not there."""
_CLEAR = 0.2
"""Share of the variance that a rule has to explain."""
_CLEAREST = 0.4
"""The same of what is far over the noise nearly all the time."""
_RATIO = 2.0
"""Inside a rule's range the power is so many times that outside, at least."""
_REVERSAL = (0.06, 0.1, 0.15, 0.2, 0.3, 0.4)
"""Times after a reversal that are tried (s)."""
_BINS = 12
_QUANTILES = np.linspace(0.1, 0.9, 17)


@dataclass(frozen=True)
class Look:
    """One recording as phases are told from it."""

    at: Float64
    """float64[B] (s)."""
    begins: float
    """How long the arm had been recorded before (s)."""
    power: Float64
    """float64[B], mean square over a few blocks, in noise floors."""
    pieces: tuple[slice, ...]
    """Stretches that are far over the noise."""
    q: Float64
    """float64[B, J] (rad, m)."""
    qd: Float64
    """float64[B, J] (rad/s, m/s)."""
    effort: Float64
    """float64[B, J], what drives the joints (N m, N)."""
    load: Float64
    """float64[B, J], what of it reaches the links (N m, N)."""

    @property
    def hot(self) -> np.ndarray:
        """Return bool[B]."""
        out = np.zeros(len(self.at), np.bool_)
        for piece in self.pieces:
            out[piece] = True
        return out


@dataclass(frozen=True)
class Phase:
    """When something is left over."""

    words: str
    joint: int | None = None
    """Column of the quantity that it goes by, if it goes by one."""


def phase_of(looks: Sequence[Look], joints: Sequence[int]) -> Phase:
    """Return when.

    Args:
        looks: all recordings, in their order; those where nothing is left over, too.
        joints: whose motion it may go by.
    """
    hot = np.concatenate([each.hot for each in looks])
    if _is_from_then(looks):
        return Phase(FROM_THEN)
    pieces = [(look, piece) for look in looks for piece in look.pieces]
    lengths = [BLOCK * (piece.stop - piece.start) for _, piece in pieces]
    if len(pieces) == 1 and lengths[0] <= _LONGEST_EVENT:
        return Phase(ONCE)
    if len(pieces) > 2 or hot.mean() > 4.0 * _FEW:
        rules = [rule for joint in joints for rule in _rules(looks, joint)]
        rules.append(_growth(looks))
        if len(joints) > 1:
            rules.append(_speed(looks, joints))
        best = max(rules, key=lambda rule: rule[0])
        if best[0] >= (_CLEAREST if hot.mean() >= _MANY else _CLEAR):
            return best[1]
    if len(pieces) <= 3 and max(lengths, default=0.0) <= _LONGEST_EVENT:
        return Phase(ONCE)
    return Phase(THROUGHOUT if hot.mean() > 0.5 else AT_TIMES)


def push_of(torque: Float64, piece: slice) -> slice | None:
    """Return when in a stretch a torque was missing; None if it was not only for a short while.

    An arm is still off when what pushed it is over, so that motion says less about when.

    Args:
        torque: float64[B] (N m, N), smooth over five blocks or so.
        piece: blocks in which the arm is off.
    """
    begin = max(piece.start - _LATE, 0)
    size: Float64 = np.abs(torque[begin : piece.stop])
    high = np.flatnonzero(size >= 0.5 * float(np.sort(size)[-min(5, len(size))]))
    first, last = int(high[0]), int(high[-1]) + 1
    inside = size[max(first - _LATE, 0) : last + _LATE]
    is_all = float(np.sum(inside**2)) >= _MOSTLY * float(np.sum(size**2))
    is_short = BLOCK * (last - first) <= _LONGEST_EVENT
    return slice(begin + first, begin + last) if is_all and is_short else None


def _is_from_then(looks: Sequence[Look]) -> bool:
    """Return whether nothing was there until an instant of one recording, and it stayed."""
    for index, look in enumerate(looks):
        if not look.pieces:
            continue
        first = look.pieces[0].start
        late = look.hot[first:]
        before = [each.hot for each in looks[:index]]
        is_quiet_before = not before or float(np.concatenate(before).mean()) <= _FEW
        stays = float(late.mean()) >= _STAYS and bool(late[-len(late) // 4 :].any())
        is_step = BLOCK * first > _SHORTEST and BLOCK * len(late) > _SHORTEST
        is_late = np.arange(len(look.at)) >= first
        told = _explained(np.log1p(look.power), look.power, is_late)
        near = round(_SHORTEST / BLOCK)
        just_before = float(look.power[max(first - near, 0) : max(first, 1)].mean())
        is_sudden = float(look.power[first : first + near].mean()) > _RATIO * just_before
        return is_quiet_before and stays and is_step and is_sudden and told >= _CLEAREST
    return False


def _rules(looks: Sequence[Look], joint: int) -> list[tuple[float, Phase]]:
    """Return how much each rule of a joint explains."""
    level = np.concatenate([np.log1p(each.power) for each in looks])
    power = np.concatenate([each.power for each in looks])

    def joined(quantity: Callable[[Look], Float64]) -> Float64:
        return np.concatenate([quantity(each) for each in looks])

    speed = joined(lambda look: np.abs(look.qd[:, joint]))
    load = joined(lambda look: np.abs(look.effort[:, joint]))
    turned = joined(lambda look: since_reversal(look.qd[:, joint]))
    shifted = joined(lambda look: since_reversal(look.load[:, joint]))
    q = joined(lambda look: look.q[:, joint])
    over = [
        ("while fast", [speed > limit for limit in np.quantile(speed, _QUANTILES)]),
        ("while slow", [speed < limit for limit in np.quantile(speed, _QUANTILES)]),
        ("while loaded", [load > limit for limit in np.quantile(load, _QUANTILES)]),
        ("after reversals", [turned < limit for limit in _REVERSAL]),
        ("after reversals of the load", [shifted < limit for limit in _REVERSAL]),
        ("near a posture", _ranges(q, level)),
    ]
    return [
        (max((_explained(level, power, inside) for inside in tries), default=0.0),
         Phase(words, joint))
        for words, tries in over
    ]  # fmt: skip


def _speed(looks: Sequence[Look], joints: Sequence[int]) -> tuple[float, Phase]:
    """Return how much the speed of all joints together explains."""
    level = np.concatenate([np.log1p(each.power) for each in looks])
    power = np.concatenate([each.power for each in looks])
    speed = np.concatenate([np.linalg.norm(each.qd[:, joints], axis=1) for each in looks])
    tries = [speed > limit for limit in np.quantile(speed, _QUANTILES)]
    return max(_explained(level, power, inside) for inside in tries), Phase("while fast")


def _growth(looks: Sequence[Look]) -> tuple[float, Phase]:
    """Return how much time explains, if the power never falls much with it."""
    time = np.concatenate([each.begins + each.at for each in looks])
    level = np.concatenate([np.log1p(each.power) for each in looks])
    power = np.concatenate([each.power for each in looks])
    fifths = [part.mean() for part in np.array_split(level[np.argsort(time)], 5)]
    if np.min(np.diff(fifths)) < -0.1 * (max(fifths) - min(fifths)):
        return 0.0, Phase(GROWS)
    tries = [time > limit for limit in np.quantile(time, _QUANTILES)]
    return max(_explained(level, power, inside) for inside in tries), Phase(GROWS)


def _explained(level: Float64, power: Float64, inside: np.ndarray) -> float:
    """Return the share of the variance of a level that being inside explains; 0 if it is lower."""
    share = float(inside.mean())
    if not _FEW / 2.0 < share < 1.0 - _FEW / 2.0:
        return 0.0
    within, without = float(level[inside].mean()), float(level[~inside].mean())
    is_higher = power[inside].mean() > _RATIO * power[~inside].mean()
    if within <= without or not is_higher:
        return 0.0
    total = float(level.var())
    return share * (1.0 - share) * (within - without) ** 2 / max(total, 1e-12)


def _ranges(q: Float64, level: Float64) -> list[np.ndarray]:
    """Return which blocks are in the range of positions where the level is highest."""
    low, high = np.quantile(q, [0.01, 0.99])
    if high - low < 1e-6:
        return []
    place = np.clip(((q - low) / (high - low) * _BINS).astype(np.int64), 0, _BINS - 1)
    count = np.bincount(place, minlength=_BINS)
    mean = np.bincount(place, level, _BINS) / np.maximum(count, 1)
    tries: list[np.ndarray] = []
    for width in (1, 2, 3, 4):
        sums = np.convolve(np.where(count > 0, mean, 0.0), np.ones(width), "valid")
        first = int(np.argmax(sums))
        tries.append((place >= first) & (place < first + width))
    return tries


def since_reversal(values: Float64) -> Float64:
    """Return float64[B], the time since the sign changed (s); what is small has no sign."""
    small = 0.05 * float(np.quantile(np.abs(values), 0.98))
    out = np.full(len(values), np.inf)
    sign, last = 0.0, -np.inf
    for index, value in enumerate(values):
        if abs(value) > small:
            if sign and np.sign(value) != sign:
                last = index
            sign = float(np.sign(value))
        out[index] = BLOCK * (index - last)
    return out
