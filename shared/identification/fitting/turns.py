"""Finds an interval that comes again and again, which its cost alone does not lead to.

Off by little, an interval is off by more at every turn, and by half of itself before the end of a
recording: the cost has a minimum at every few such steps. So it is sought as a frequency is,
roughly in the second that shows it best, then closer in that second of all recordings, in what is
around it up to twice as far, and so on. Which command a turn takes jumps, too: off by a thousandth,
one turn in ten takes another one. So it is sought with smooth commands, too. What the base could
absorb is taken out of the cost: the mean delay, which half of an interval makes, is much of what an
interval does, and says little about it.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from shared.identification.dataset.types import Float64
from shared.identification.fitting.space import Space

LATE = {"sample_and_hold": "command_latency"}
"""What hardly differs from another cause while it is small: a command that is taken at intervals
is late by half of one."""
_FIRST = 1.0
"""How far about the part that shows it best is looked at first (s)."""
_FINE = 6.0
"""Steps in which a turn at the end of what is looked at moves by a whole interval."""


class About(NamedTuple):
    """How well an interval is known."""

    factor: float
    """Times as long, or as short, as it may be."""
    least: float
    """The same, where turns come too often to look so far."""
    phases: int
    """Of a turn, that are tried first."""
    closer: int
    """Times that steps are halved once all of the recordings are looked at."""


WIDE = About(1.6, 1.6, 8, 2)
"""Where only the screen has seen it."""
LIKELY = About(1.6, 1.25, 8, 2)
"""Where it makes the delay that fits best: half of it, and what the base makes up for."""
NEAR = About(1.005, 1.005, 32, 5)
"""Where the base was fitted with it. Which command a turn takes jumps, so of a hundred turns the
one that is nearest to a command must be right to a hundredth of their interval."""
_ABOUT = NEAR._replace(closer=1)
"""Where it was found by smooth commands, before the base is fitted with it."""
_FEWEST, _MOST = 5, 256
"""Intervals tried first. Where it would take more, turns come so often that only their mean shows,
and that is smooth."""
_KEPT = (24, 12, 6, 4, 3)
"""Best ones that are looked at more closely, of one part, of what is around it, and so on: one part
alone prefers wrong ones by as much as what a phase that is off by a sixteenth of a turn costs."""
_SAME = 10
"""Pairs are the same that are in the same one of so many parts of a step."""
_AROUND = (-1.0, -0.5, 0.0, 0.5, 1.0)
"""Steps about what was kept."""


@dataclass(frozen=True)
class Turning:
    """Which of a vector's numbers are an interval and the phase of its first turn."""

    interval: int
    interval_probe: float
    phase: int
    phase_probe: float

    def at(self, z: Float64, interval: float, phase: float, since: float = 0.0) -> Float64:
        """Return a vector with them in their own units.

        Args:
            z: float64[n], the vector.
            interval: in its own unit.
            phase: how much of an interval passes from then on until the next turn.
            since: then, after the first command (s).
        """
        moved = z.copy()
        moved[self.interval] = interval / self.interval_probe
        moved[self.phase] = (phase + since / interval) % 1.0 / self.phase_probe
        return moved


def turning_of(space: Space) -> Turning | None:
    """Return where the newest candidate of a space has an interval, None where it has none."""
    candidate = space.candidates[-1]
    quantities = candidate.effect.quantities(space.problem.subject, candidate.place)
    first = space.size - len(quantities)
    for index, each in enumerate(quantities):
        if each.phase:
            names = [other.name for other in quantities]
            phase = names.index(each.phase)
            return Turning(first + index, each.probe, first + phase, quantities[phase].probe)
    return None


def aligned(
    space: Space,
    z: Float64,
    segments: tuple[int, ...],
    about: About = WIDE,
    base: Float64 | None = None,
) -> Float64:
    """Return the vector with the interval, and the phase, that fit best; as it is if none do.

    Args:
        space: its newest candidate may have an interval; the vector stays as it is if it has none,
            or one so short that turns cannot be told apart.
        z: float64[n], with about the interval.
        segments: recordings to fit to.
        about: how well it is known.
        base: float64[M, b], derivative on the segments by the numbers before the candidate's; what
            they could absorb is taken out of the cost.
    """
    turning = turning_of(space)
    if turning is None or z[turning.interval] <= 0.0:
        return z
    ways = [(space, z, about)]
    if about is not NEAR:
        rough = _sought(space.smooth(), z, turning, segments, about, base)
        ways += [] if rough is None else [(space, rough, _ABOUT)]
    found = [_sought(where, begun, turning, segments, how, base) for where, begun, how in ways]
    tries = [z, *(each for each in found if each is not None)]
    if len(tries) == 1:
        return z
    return tries[int(np.argmin(_Cost(space, segments, base)(tries, segments)))]


def _sought(
    space: Space, z: Float64, turning: Turning, segments: tuple[int, ...], about: About,
    base: Float64 | None,
) -> Float64 | None:  # fmt: skip
    """Return the vector with the interval and phase that fit best; None if turns come too often."""
    parts = {segment: space.problem.segments[segment].recorded for segment in segments}
    expected = float(z[turning.interval]) * turning.interval_probe
    last = max(part.begin + float(part.joints_at[-1]) for part in parts.values())
    reach = max(_FIRST, *(float(part.joints_at[-1]) for part in parts.values()))
    step = expected**2 / (_FINE * reach)
    room = _MOST * step / expected  # of high - low, of which either is as many times off
    factor = min(about.factor, 0.5 * (room + np.hypot(room, 2.0)))
    if factor < about.least:
        return None
    low, high = expected / factor, expected * factor
    count = max(int(np.ceil((high - low) / max(step, 1e-9))), _FEWEST)
    cost = _Cost(space, segments, base)
    wider = 1.0 / about.phases
    tries: list[tuple[float, float]] = [
        (float(interval), phase * wider)
        for interval in np.geomspace(low, high, count)
        for phase in range(about.phases)
    ]
    telling = cost.telling(turning.at(z, expected, 0.0), turning.at(z, expected, 0.5))
    since = parts[telling].begin
    last = max(since, last - since)
    costs = cost([turning.at(z, *each, since) for each in tries], (telling,))
    closer, turn = 0, 0
    apart = float((high / low) ** (1.0 / (count - 1))) - 1.0
    while True:
        most = _KEPT[min(turn, len(_KEPT) - 1)]
        best = _best(tries, costs, apart, wider, most)
        fine = _FINE * min(reach, last) * 2.0**closer
        apart = best[0][0] / fine
        tries = _around(best, apart * best[0][0], wider)
        picked = tuple(
            segment for segment in segments if -reach < parts[segment].begin - since < reach
        )
        vectors = [space.clip(turning.at(z, interval, phase, since)) for interval, phase in tries]
        costs = cost(vectors, picked)
        if reach >= last and closer == about.closer:
            return vectors[int(np.argmin(costs))]
        closer += reach >= last
        turn += 1
        reach *= 2.0
        wider *= 0.5


def _best(
    tries: list[tuple[float, float]], costs: Float64, apart: float, wider: float, most: int
) -> list[tuple[float, float]]:
    """Return the pairs of least cost, none of which is the next one to a better one.

    Args:
        tries: intervals and phases.
        costs: float64[T], theirs.
        apart: from one interval to the next, as a share of it.
        wider: from one phase to the next.
        most: how many.
    """
    kept: list[tuple[float, float]] = []
    order: list[int] = np.argsort(costs).tolist()
    for index in order:
        interval, phase = tries[index]
        if len(kept) == most:
            break
        if not any(
            abs(interval / one - 1.0) < 1.5 * apart
            and abs((phase - other + 0.5) % 1.0 - 0.5) < 1.5 * wider
            for one, other in kept
        ):
            kept.append((interval, phase))
    return kept


def _around(
    best: list[tuple[float, float]], step: float, wider: float
) -> list[tuple[float, float]]:
    """Return pairs about the best ones; of those that are all but the same, one.

    Args:
        best: intervals and phases, the best one first.
        step: of intervals.
        wider: of phases.
    """
    found: dict[tuple[int, int], tuple[float, float]] = {}
    for interval, phase in best:
        for along in _AROUND:
            for around in (-1.0, 0.0, 1.0):
                pair = (interval + along * step, phase + around * wider)
                at = (round(_SAME * pair[0] / step), round(_SAME * pair[1] / wider))
                found.setdefault(at, pair)
    return list(found.values())


class _Cost:
    """Sums of squares, without what other numbers could absorb."""

    def __init__(self, space: Space, segments: tuple[int, ...], base: Float64 | None) -> None:
        self._space, self._segments, self._base = space, segments, base

    def __call__(self, vectors: list[Float64], picked: tuple[int, ...]) -> Float64:
        """Return float64[V]: of each vector, on some of the segments."""
        found = self._space.residual(vectors, picked)
        if self._base is None:
            return np.asarray(np.sum(found**2, axis=1), np.float64)
        problem, numbers = self._space.problem, self._base.shape[1]
        sizes = [problem.size_of(segment) for segment in self._segments]
        wanted = [segment in picked for segment in self._segments]
        rows = self._base[: sum(sizes)][np.repeat(wanted, sizes)]
        found = found[:, : len(rows) + numbers]  # what is known of them beforehand counts
        able = np.concatenate([rows, np.diag(1.0 / self._space.priors[:numbers])])
        basis = np.linalg.qr(able).Q
        return np.asarray(np.sum((found - found @ basis @ basis.T) ** 2, axis=1), np.float64)

    def telling(self, one: Float64, other: Float64) -> int:
        """Return the segment in which two vectors differ most."""
        differ = [
            float(np.sum(np.ptp(self._space.residual([one, other], (segment,)), axis=0) ** 2))
            for segment in self._segments
        ]
        return self._segments[int(np.argmax(differ))]
