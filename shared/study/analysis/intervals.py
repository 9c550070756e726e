"""95 % intervals of means, effect sizes, correlations, shares and reliabilities.

All by closed formulas or by turning a noncentral distribution around (Steiger 2004, Psychological
Methods 9(2)); None stands for an end that cannot be had.
"""

# pyright: basic
# (scipy's types are partial)

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import optimize, stats

from shared.study.analysis.finding import CONFIDENCE, Estimate

Floats = NDArray[np.float64]
TAIL = (1.0 - CONFIDENCE) / 2.0
MOST_STEPS = 60
"""Of doubling, to bracket a noncentrality."""


def mean_estimate(values: Floats, name: str) -> Estimate:
    """Return the mean with its t interval; no interval below two values."""
    mean = float(np.mean(values))
    if len(values) < 2:
        return Estimate(name=name, value=mean)
    half = float(stats.t.ppf(1.0 - TAIL, len(values) - 1)) * float(stats.sem(values))
    return Estimate(name=name, value=mean, low=mean - half, high=mean + half, method="t")


def effect_dz(t: float, n: float, df: float | None = None) -> Estimate:
    """Return the standardised mean of n differences, t / sqrt(n), by the noncentral t.

    Args:
        t: the statistic.
        n: differences that the mean is worth.
        df: of t; None is n - 1.
    """
    root, free = math.sqrt(n), n - 1 if df is None else df
    low = _noncentrality(lambda nc: float(stats.nct.cdf(t, free, nc)) - (1.0 - TAIL), t)
    high = _noncentrality(lambda nc: float(stats.nct.cdf(t, free, nc)) - TAIL, t)
    return Estimate(
        name="d_z",
        value=t / root,
        low=None if low is None else low / root,
        high=None if high is None else high / root,
        method="noncentral t",
    )


def partial_eta_squared(f: float, df: tuple[float, float]) -> Estimate:
    """Return the share of variance an F statistic stands for, with its noncentral F interval."""

    def end(area: float) -> float | None:
        def excess(nc: float) -> float:
            return float(stats.ncf.cdf(f, df[0], df[1], nc)) - area

        if float(stats.f.cdf(f, *df)) <= area:
            return 0.0
        found = _noncentrality(excess, max(df[0] * (f - 1.0), 0.0), floor=1e-9)
        return None if found is None else found / (found + df[0] + df[1] + 1.0)

    value = f * df[0] / (f * df[0] + df[1])
    return Estimate(
        name="partial eta squared", value=value, low=end(1.0 - TAIL), high=end(TAIL),
        method="noncentral F",
    )  # fmt: skip


def correlation_estimate(r: float, n: float, name: str, *, spread: float = 1.0) -> Estimate:
    """Return a correlation of n pairs with its Fisher z interval.

    Args:
        r: the coefficient, -1 to 1.
        n: pairs, or degrees of freedom + 2.
        name: of the coefficient.
        spread: variance of z times n - 3; 1 for Pearson's, 1 + r^2 / 2 for Spearman's (Bonett &
            Wright 2000, Psychometrika 65(1)).
    """
    if n <= 3 or abs(r) >= 1.0:
        return Estimate(name=name, value=r)
    half = float(stats.norm.ppf(1.0 - TAIL)) * math.sqrt(spread / (n - 3))
    z = math.atanh(r)
    return Estimate(
        name=name, value=r, low=math.tanh(z - half), high=math.tanh(z + half), method="Fisher z"
    )


def share_estimate(count: int, n: int, name: str) -> Estimate:
    """Return a share with its exact binomial interval (Clopper & Pearson 1934)."""
    interval = stats.binomtest(count, n).proportion_ci(CONFIDENCE, method="exact")
    return Estimate(
        name=name, value=count / n, low=float(interval.low), high=float(interval.high),
        method="exact binomial",
    )  # fmt: skip


def alpha_estimate(alpha: float, people: int, items: int) -> Estimate:
    """Return Cronbach's alpha with its interval (Feldt 1965, Psychometrika 30(3))."""
    df = (people - 1, (people - 1) * (items - 1))
    return Estimate(
        name="Cronbach's alpha",
        value=alpha,
        low=1.0 - (1.0 - alpha) * float(stats.f.ppf(1.0 - TAIL, *df)),
        high=1.0 - (1.0 - alpha) * float(stats.f.ppf(TAIL, *df)),
        method="Feldt",
    )


def resampled(
    rows: Floats, statistic: Callable[[Floats], Floats], generator: np.random.Generator,
    name: str, *, resamples: int = 1000,
) -> Estimate:  # fmt: skip
    """Return a statistic of people with its percentile bootstrap interval, whole people drawn.

    Args:
        rows: float64[n, k], a row a person.
        statistic: of float64[R, n, k]; gives float64[R].
        generator: draws the people.
        name: of the statistic.
        resamples: R.
    """
    value = float(statistic(rows[None])[0])
    drawn = generator.integers(0, len(rows), (resamples, len(rows)))
    values = statistic(rows[drawn])
    values = values[np.isfinite(values)]
    if len(rows) < 3 or not len(values):
        return Estimate(name=name, value=value)
    low, high = np.quantile(values, [TAIL, 1.0 - TAIL])
    return Estimate(
        name=name, value=value, low=float(low), high=float(high), method="bootstrap over people"
    )


def _noncentrality(
    excess: Callable[[float], float], start: float, floor: float | None = None
) -> float | None:
    """Return where a falling function crosses zero, None where it cannot be found."""
    width = 2.0 + 0.5 * abs(start)
    low, high = start - width, start + width
    for _ in range(MOST_STEPS):
        if floor is not None:
            low = max(low, floor)
        below, above = excess(low), excess(high)
        if not (math.isfinite(below) and math.isfinite(above)):
            return None
        if below >= 0.0 >= above:
            try:
                root: Any = optimize.brentq(excess, low, high, xtol=1e-10)
            except ValueError:  # NaN on the way: scipy's noncentral t has no digits left there
                return None
            return float(root)
        width *= 2.0
        low, high = (low - width if below < 0.0 else low), (high + width if above > 0.0 else high)
    return None
