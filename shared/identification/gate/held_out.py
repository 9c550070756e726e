"""Decides on recordings that nothing was fitted to.

The training loss always prefers more parameters: of ten data sets without a hidden effect ten had
one named by an information criterion. So a cause counts only by what it takes off the held-out
loss, stretch by stretch, with an interval.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.special import ndtri, stdtrit

from shared.identification.dataset.types import Float64
from shared.identification.fitting.problem import BLOCK, Problem, Variant

STRETCH = 0.5
"""What is resampled: longer than noise or the arm remembers (s)."""
FLOOR = 1.15
"""Mean square residual of a right model, in noise floors: a repeat or two measure the floor only
so well, and no base fit is perfect."""
LEAST_SHARE = 0.05
"""Of the base fit's explainable held-out loss that a cause must take off to be of use."""
LEAST_GAIN = 0.06
"""Of the held-out loss that is left when it comes, the same."""
LEAST_OF_EXCESS = 0.25
"""Where repeats have measured the noise: of what is left beyond it. If that is little, some of it
is the base's fault, and many a cause takes a little of that off; if another cause was far larger,
it is what makes one of use beside it."""
FEWEST = 4
"""Stretches that it takes to be sure of anything."""
_DRAWS = 2000


def floor_of(base: float) -> float:
    """Return what a right model would leave, given what the base fit leaves."""
    return min(FLOOR, 0.7 * base)


class Least(NamedTuple):
    """What a cause must take off at least, where repeats have measured the noise."""

    at_all: float
    """Of the loss that is left when it comes."""
    beside: float
    """Of what other causes took off before."""
    noise: float
    """Mean square residual that may be noise, in noise floors: of the rest it is a quarter."""


BY_LOSS = Least(at_all=0.04, beside=0.005, noise=1.0)
"""Beside others, since no law is quite the arm's, and one that is off by 7 % of what it does leaves
so much for another to make up for."""
FAR_FROM_LINKS = BY_LOSS._replace(at_all=0.02, noise=FLOOR)
"""The same of a cause that links could make up for on what was held out, but not on what was fitted
to, near what is known of them: that is sure of it."""
BY_FOLLOWING = Least(at_all=0.0025, beside=0.001, noise=FLOOR)
"""Of a cause that what was held out follows, see ``foretold.py``: it is sure, so small as it is.
Of nothing hidden 0.2 % at most was followed, of what is there 0.3 % and more (ADR 0013)."""


class Taken(NamedTuple):
    """What a cause takes off a mean square residual, in noise floors."""

    before: float
    gain: float

    def excess(self, least: Least) -> float:
        """Return what it is to take off of what is more than noise."""
        return max(LEAST_OF_EXCESS * (self.before - least.noise), 0.0)

    def is_enough(self, least: Least, is_measured: bool) -> bool:
        """Return whether it is enough of what was left before."""
        wanted = LEAST_GAIN * self.before
        if is_measured:
            wanted = min(self.excess(least), max(wanted, LEAST_OF_EXCESS))
            wanted = max(wanted, least.at_all * self.before)
        return self.gain >= wanted


@dataclass(frozen=True)
class Gain:
    """What a model takes off the held-out loss of another."""

    loss: float
    """Mean square residual of the better one, in noise floors."""
    before: float
    """Of the other."""
    low: float
    """95 % interval of the difference; wider by Student's t where there are few stretches."""
    high: float
    surely: float
    """Low end of the 99 % interval; minus infinity where stretches are too few to be sure."""
    error: float
    """Standard error of the difference."""
    is_measured: bool = False
    """Whether repeats say that a mean square of 1 is noise."""
    apart: Taken | None = None
    """Where what was held out surely follows what the cause foretells: what it takes off there,
    without what the base could make up for. The loss itself has in it what the recordings that were
    fitted to do not show of the base."""
    is_far_from_links: bool = False
    """Whether of what was fitted to links could surely not make up for it, near what is known of
    them, as they could of what was held out."""

    @property
    def gain(self) -> float:
        """Return the difference."""
        return self.before - self.loss

    def share(self, base: float) -> float:
        """Return it as a share of what is explainable, at most all of it.

        Args:
            base: the base fit's loss.
        """
        return min(self.gain / (base - floor_of(base)), 1.0)

    def share_interval(self, base: float) -> tuple[float, float]:
        """Return the 95 % interval of :meth:`share`."""
        explainable = base - floor_of(base)
        return min(self.low / explainable, 1.0), min(self.high / explainable, 1.0)

    @property
    def _ways(self) -> list[tuple[Taken, Least]]:
        """Return in which ways it is surely better, and by enough."""
        ways: list[tuple[Taken, Least]] = []
        if self.surely > 0.0:
            least = FAR_FROM_LINKS if self.is_far_from_links else BY_LOSS
            ways.append((Taken(self.before, self.gain), least))
        if self.apart is not None:
            ways.append((self.apart, BY_FOLLOWING))
        return [(taken, least) for taken, least in ways if taken.is_enough(least, self.is_measured)]

    @property
    def is_sure(self) -> bool:
        """Return whether it is surely better, and by enough."""
        return bool(self._ways)

    def is_useful(self, base: float) -> bool:
        """Return whether it passes: surely better, by enough, and of use beside what there was."""
        if self._ways and self.share(base) >= LEAST_SHARE:
            return True
        return self.is_measured and any(
            taken.gain >= max(taken.excess(least), least.beside * (base - self.before))
            for taken, least in self._ways
        )


def stretches(problem: Problem, variant: Variant, segments: tuple[int, ...]) -> Float64:
    """Return float64[S], mean square residual of each stretch of ``STRETCH``.

    A part of a recording counts without the blocks that the problem says not to count.
    """
    return _of_all(problem, segments, problem.residuals([variant], segments)[0]).mean(axis=1)


def plain_stretches(problem: Problem, variant: Variant, segments: tuple[int, ...]) -> Float64:
    """Return the same of plain residuals: how far off a model is, not how surely."""
    return plain_channels(problem, variant, segments).mean(axis=1)


def plain_channels(problem: Problem, variant: Variant, segments: tuple[int, ...]) -> Float64:
    """Return float64[S, C], the same of each channel."""
    return _of_all(problem, segments, problem.plain(variant, segments))


def _of_all(problem: Problem, segments: tuple[int, ...], parts: list[Float64]) -> Float64:
    found = [_by_channel(problem, *each) for each in zip(segments, parts, strict=True)]
    return np.concatenate(found)


def parted(problem: Problem, segment: int, residual: Float64) -> Float64:
    """Return float64[S], mean square of each stretch of one segment's residual, float64[B, C]."""
    return _by_channel(problem, segment, residual).mean(axis=1)


def _by_channel(problem: Problem, segment: int, residual: Float64) -> Float64:
    """Return float64[S, C], the same of each channel."""
    power = residual**2
    if segment in problem.uncounted:
        power = power[~problem.uncounted[segment]]
    if not len(power):
        return np.empty((0, residual.shape[1]))
    count = max(len(power) // round(STRETCH / BLOCK), 1)
    return np.array([piece.mean(axis=0) for piece in np.array_split(power, count)])


def compare(before: Float64, after: Float64, rng: np.random.Generator) -> Gain:
    """Return what is taken off, by bootstrap over stretches.

    Args:
        before: float64[S].
        after: float64[S], of the same stretches.
        rng: draws.
    """
    difference = before - after
    picks = rng.integers(0, len(difference), (_DRAWS, len(difference)))
    means = difference[picks].mean(axis=1)
    gain, count = float(difference.mean()), len(difference)
    if count == 1:  # nothing is known of how much it varies
        means = np.array([0.0, 2.0 * gain])
    low, high, surely = np.quantile(means, [0.025, 0.975, 0.005])
    free = max(count - 1, 1)
    wider = float(stdtrit(free, 0.975) / ndtri(0.975) * np.sqrt((free + 1) / free))
    return Gain(
        loss=float(after.mean()),
        before=float(before.mean()),
        low=gain + wider * float(low - gain),
        high=gain + wider * float(high - gain),
        surely=float(surely) if count >= FEWEST else -np.inf,
        error=float(means.std()),
    )
