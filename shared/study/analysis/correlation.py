"""Correlations: Pearson's with Spearman's beside it, and within people."""

# pyright: basic
# (scipy's types are partial)

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from shared.study.analysis.finding import Finding, missing_text, not_done
from shared.study.analysis.intervals import correlation_estimate
from shared.study.analysis.paired import normality

Floats = NDArray[np.float64]
FEWEST = 4
"""Pairs below which nothing is correlated: an interval needs n - 3 above zero."""


def pearson(x: Floats, y: Floats, question: str, *, unit: str = "people") -> Finding:
    """Return Pearson's correlation of pairs, Spearman's beside it.

    Args:
        x: float64[n]; a pair with a NaN is left out.
        y: float64[n].
        question: what is asked.
        unit: what a pair is.
    """
    test = "Pearson correlation"
    one, two, left_out = _complete(x, y, unit)
    n = len(one)
    if why := _why_not(one, two):
        return not_done(question, test, n, why, unit=unit, left_out=left_out)
    found: Any = stats.pearsonr(one, two)
    r = float(found.statistic)
    return Finding(
        question=question,
        test=test,
        n=n,
        unit=unit,
        symbol="r",
        statistic=r,
        df=(n - 2.0,),
        p=float(found.pvalue),
        effect=correlation_estimate(r, n, "r"),
        checks=(*normality(one, "the first is normal"), *normality(two, "the second is normal")),
        beside=(spearman(one, two, question, unit=unit),),
        left_out=left_out,
    )


def spearman(x: Floats, y: Floats, question: str, *, unit: str = "people") -> Finding:
    """Return Spearman's rank correlation of pairs; one with a NaN is left out."""
    test = "Spearman correlation"
    one, two, left_out = _complete(x, y, unit)
    n = len(one)
    if why := _why_not(one, two):
        return not_done(question, test, n, why, unit=unit, left_out=left_out)
    found: Any = stats.spearmanr(one, two)
    rho = float(found.statistic)
    return Finding(
        question=question,
        test=test,
        n=n,
        unit=unit,
        symbol="rho",
        statistic=rho,
        p=float(found.pvalue),
        effect=correlation_estimate(rho, n, "rho", spread=1.0 + rho**2 / 2.0),
        left_out=left_out,
    )


def within_people(first: Floats, second: Floats, question: str) -> Finding:
    """Return the correlation of two measures within people, people's own levels taken out.

    Repeated-measures correlation (Bakdash & Marusich 2017, Frontiers in Psychology 8:456), which
    does not take the rows of one person for different people.

    Args:
        first: float64[n, k], a row a person; NaN where there is none.
        second: float64[n, k], of the same people and occasions.
        question: what is asked.
    """
    test = "correlation within people"
    both = np.isfinite(first) & np.isfinite(second)
    kept = both & (both.sum(axis=1) >= 2)[:, None]
    people, pairs = int(kept.any(axis=1).sum()), int(kept.sum())
    left_out = missing_text(
        first.size - pairs, "pairs", "a value is missing, or a person's only one"
    )
    df = pairs - people - 1
    x, y = _centred(first, kept), _centred(second, kept)
    xx, yy = float(x @ x), float(y @ y)
    if df < 2 or xx == 0.0 or yy == 0.0:
        return not_done(
            question, test, people, "too few pairs, or nothing varies", left_out=left_out
        )
    r = float(np.clip(x @ y / np.sqrt(xx * yy), -1.0, 1.0))
    t = r * np.sqrt(df / max(1.0 - r * r, 1e-300))
    return Finding(
        question=question,
        test=test,
        n=people,
        symbol="r",
        statistic=r,
        df=(float(df),),
        p=float(2.0 * stats.t.sf(abs(t), df)),
        effect=correlation_estimate(r, df + 2, "r within people"),
        left_out=left_out,
    )


def _centred(values: Floats, kept: NDArray[np.bool_]) -> Floats:
    count = np.maximum(kept.sum(axis=1), 1)
    means = np.where(kept, values, 0.0).sum(axis=1) / count
    return (values - means[:, None])[kept]


def _why_not(one: Floats, two: Floats) -> str:
    """Return why complete pairs cannot be correlated; empty where they can."""
    if len(one) >= FEWEST and np.ptp(one) > 0.0 and np.ptp(two) > 0.0:
        return ""
    return f"{len(one)} pairs, it needs {FEWEST} that vary"


def _complete(x: Floats, y: Floats, unit: str) -> tuple[Floats, Floats, tuple[str, ...]]:
    there = np.isfinite(x) & np.isfinite(y)
    left_out = missing_text(int((~there).sum()), unit, "one of both values is missing")
    return x[there], y[there], left_out
