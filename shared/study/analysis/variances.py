"""Whether two groups of people differ in how much they vary: Welch's test of log variances."""

# pyright: basic
# (scipy's types are partial)

import math
from collections.abc import Sequence
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray
from scipy import stats

from shared.study.analysis.finding import Estimate, Finding, not_done
from shared.study.analysis.paired import holm
from shared.study.analysis.regression import welch

Floats = NDArray[np.float64]
TEST = "Welch t-test of log variances"


def compare_variances(
    first: Floats, second: Floats, questions: Sequence[str]
) -> tuple[Finding, ...]:
    """Return whether people of the first group vary more, for each measure, Holm over measures.

    The logarithm makes variances of few games nearly normal; the estimate is the ratio of
    geometric means.

    Args:
        first: float64[n, k], a person's variance of each of k measures, above zero.
        second: float64[m, k], of the other group.
        questions: str[k].
    """
    return holm([_one(first[:, k], second[:, k], q) for k, q in enumerate(questions)])


def _one(first: Floats, second: Floats, question: str) -> Finding:
    one, two = first[np.isfinite(first) & (first > 0.0)], second[np.isfinite(second) & (second > 0)]
    n = len(one) + len(two)
    if min(len(one), len(two)) < 2:
        return not_done(question, TEST, n, "a group has fewer than 2 people who vary")
    found = welch(np.log(one), np.log(two), question)
    if found.estimate is None or found.estimate.low is None or found.estimate.high is None:
        return found
    ranks: Any = stats.mannwhitneyu(one, two)
    share = float(ranks.statistic) / (len(one) * len(two))
    return msgspec.structs.replace(
        found,
        test=TEST,
        unit="people",
        estimate=Estimate(
            name="ratio of variances", value=math.exp(found.estimate.value),
            low=math.exp(found.estimate.low), high=math.exp(found.estimate.high), method="t, log",
        ),
        beside=(
            Finding(
                question=question, test="Mann-Whitney", n=n, symbol="U",
                statistic=float(ranks.statistic), p=float(ranks.pvalue),
                effect=Estimate(name="chance that one of the first varies more", value=share),
            ),
        ),
        note="",
    )  # fmt: skip
