"""Tests of differences within people: the paired t-test and, beside it, Wilcoxon's.

A paired test is a one-sample test of the differences, and is done as one.
"""

# pyright: basic
# (scipy's types are partial)

import dataclasses
import itertools
from collections.abc import Sequence
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray
from scipy import stats

from shared.study.analysis.finding import (
    Check,
    Estimate,
    Finding,
    check,
    missing_text,
    not_done,
)
from shared.study.analysis.intervals import TAIL, effect_dz, mean_estimate

Floats = NDArray[np.float64]
FEWEST = 3
"""People below which no test of means is done."""
NOTHING_VARIES = 1e-12
"""Spread, relative to the size of the numbers, below which they count as all the same."""


@dataclasses.dataclass(frozen=True)
class Named:
    """What a test is called in the report."""

    question: str
    estimate: str = "mean difference"
    test: str = "paired t-test"
    unit: str = "people"


def paired(first: Floats, second: Floats, named: Named) -> Finding:
    """Return the paired t-test of first - second, Wilcoxon's signed-rank test beside it.

    Args:
        first: float64[n], a value a person; NaN where there is none.
        second: float64[n], of the same people.
        named: what it is called.
    """
    return one_sample(np.asarray(first, np.float64) - np.asarray(second, np.float64), named)


def one_sample(values: Floats, named: Named) -> Finding:
    """Return the t-test of a mean against zero, Wilcoxon's signed-rank test beside it.

    Args:
        values: float64[n]; NaN is left out.
        named: what it is called.
    """
    there = values[np.isfinite(values)]
    n = len(there)
    left_out = missing_text(len(values) - n, "without a value", "no complete pair or value")
    if n < FEWEST:
        why = f"{n} values, a test needs at least {FEWEST}"
        return not_done(named.question, named.test, n, why, unit=named.unit, left_out=left_out)
    estimate = mean_estimate(there, named.estimate)
    if _is_constant(there):
        what = "all are zero" if not there.any() else f"all are {there[0]:g}, nothing varies"
        made = not_done(named.question, named.test, n, what, unit=named.unit, left_out=left_out)
        bare = Estimate(name=named.estimate, value=float(there[0]))
        return msgspec.structs.replace(made, estimate=bare)
    found: Any = stats.ttest_1samp(there, 0.0)
    t = float(found.statistic)
    return Finding(
        question=named.question,
        test=named.test,
        n=n,
        unit=named.unit,
        symbol="t",
        statistic=t,
        df=(n - 1.0,),
        p=float(found.pvalue),
        estimate=estimate,
        effect=effect_dz(t, n),
        checks=normality(there, "differences are normal"),
        beside=(signed_rank(there, named),),
        left_out=left_out,
    )


def signed_rank(values: Floats, named: Named) -> Finding:
    """Return Wilcoxon's signed-rank test against zero; zeros are dropped, as he did.

    p is exact, given which values tie: every pattern of signs is counted.

    Args:
        values: float64[n], finite.
        named: what it is called.
    """
    test = "Wilcoxon signed-rank"
    moved = values[values != 0.0]
    if not len(moved):
        return not_done(named.question, test, len(values), "all are zero", unit=named.unit)
    ranks: Any = stats.rankdata(np.abs(moved))
    above, total = float(ranks[moved > 0.0].sum()), float(ranks.sum())
    smaller = min(above, total - above)
    chances = _rank_sum_chances(np.rint(2.0 * ranks).astype(np.int64))
    p = min(1.0, 2.0 * float(chances[: round(2.0 * smaller) + 1].sum()))
    zeros = len(values) - len(moved)
    return Finding(
        question=named.question,
        test=test,
        n=len(values),
        unit=named.unit,
        symbol="W",
        statistic=smaller,
        p=p,
        estimate=hodges_lehmann(values),
        effect=Estimate(name="rank-biserial r", value=(2.0 * above - total) / total),
        left_out=missing_text(zeros, "zeros", "they have no sign"),
    )


def hodges_lehmann(values: Floats) -> Estimate:
    """Return the median of pairwise means, with the interval that belongs to the signed-rank test.

    Hollander & Wolfe 1999, Nonparametric Statistical Methods, 3.3; exact without ties.

    Args:
        values: float64[n], n <= some hundreds: n^2 / 2 means are made.
    """
    n = len(values)
    rows, columns = np.triu_indices(n)
    walsh = np.sort((values[rows] + values[columns]) / 2.0)
    below = int(
        np.searchsorted(np.cumsum(_rank_sum_chances(np.arange(1, n + 1))), TAIL, side="right")
    )
    method = "signed ranks"
    value = float(np.median(walsh))
    if below == 0:  # even the whole range is no 95 % interval
        return Estimate(name="Hodges-Lehmann", value=value)
    low, high = float(walsh[below - 1]), float(walsh[len(walsh) - below])
    return Estimate(name="Hodges-Lehmann", value=value, low=low, high=high, method=method)


def pairwise(
    cube: Floats, names: Sequence[str], question: str, unit: str = "mean difference"
) -> tuple[Finding, ...]:
    """Return paired tests of every two columns, Holm's correction over all of them.

    Args:
        cube: float64[n, k], a row a person; NaN where there is none.
        names: str[k], of the columns.
        question: begins each test's.
        unit: name of the estimate.
    """
    found = [
        paired(cube[:, a], cube[:, b], Named(f"{question}: {names[a]} - {names[b]}", unit))
        for a, b in itertools.combinations(range(len(names)), 2)
    ]
    return holm(found)


def holm(findings: Sequence[Finding]) -> tuple[Finding, ...]:
    """Return the findings with p adjusted for how many were done (Holm 1979)."""
    done = [k for k, finding in enumerate(findings) if finding.p is not None]
    if len(done) < 2:
        return tuple(findings)
    made = list(findings)
    least = 0.0
    for rank, k in enumerate(sorted(done, key=lambda k: findings[k].p or 0.0)):
        least = max(least, min(1.0, (len(done) - rank) * (findings[k].p or 0.0)))
        made[k] = msgspec.structs.replace(made[k], p_adjusted=least, family=len(done))
    return tuple(made)


def normality(values: Floats, assumption: str) -> tuple[Check, ...]:
    """Return Shapiro and Wilk's test, nothing where it cannot be done."""
    if not FEWEST <= len(values) <= 5000 or _is_constant(values):
        return ()
    found: Any = stats.shapiro(values)
    return (check(assumption, "Shapiro-Wilk", float(found.statistic), float(found.pvalue)),)


def _is_constant(values: Floats) -> bool:
    return float(np.ptp(values)) <= NOTHING_VARIES * max(1.0, float(np.max(np.abs(values))))


def _rank_sum_chances(ranks: NDArray[np.int64]) -> Floats:
    """Return float64[sum + 1], the null chance of each sum of the ranks with a plus sign."""
    chances = np.ones(1)
    for rank in ranks.tolist():
        grown = np.zeros(len(chances) + rank)
        grown[: len(chances)] += chances
        grown[rank:] += chances
        chances = grown / 2.0
    return chances
