"""Shares, scales and what people ticked: percentages, medians, Cronbach's alpha."""

# pyright: basic
# (scipy's types are partial)

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from shared.study.analysis.finding import Estimate, Finding, missing_text, not_done
from shared.study.analysis.intervals import alpha_estimate, share_estimate

Floats = NDArray[np.float64]


def percentages(answers: Floats, points: int) -> Floats:
    """Return float64[points], the percentage of answers at 1, 2, ..., points; NaN is left out."""
    there = answers[np.isfinite(answers)].astype(np.int64)
    counts = np.bincount(there - 1, minlength=points)[:points]
    return 100.0 * counts / max(len(there), 1)


def cronbach_alpha(items: Floats) -> Estimate | None:
    """Return Cronbach's alpha with its interval; None below two items or three complete people.

    Args:
        items: float64[n, k], turned round where reversed; a row with a NaN is left out.
    """
    whole = items[np.isfinite(items).all(axis=1)]
    n, k = whole.shape
    if n < 3 or k < 2:
        return None
    total = float(whole.sum(axis=1).var(ddof=1))
    if total == 0.0:
        return None
    alpha = k / (k - 1.0) * (1.0 - float(whole.var(axis=0, ddof=1).sum()) / total)
    return alpha_estimate(alpha, n, k)


def choice(
    first: int, second: int, neither: int, missing: int, names: tuple[str, str], question: str
) -> Finding:
    """Return the share of people who chose the first of two, and whether more did than the second.

    The share is of everybody who answered; the test is of those who decided.

    Args:
        first: people who chose the first.
        second: people who chose the second.
        neither: people who said equally.
        missing: people without an answer.
        names: of both.
        question: what is asked.
    """  # fmt: skip
    test = "exact binomial test"
    answered, decided = first + second + neither, first + second
    left_out = (
        *missing_text(missing, "people", "no answer"),
        *missing_text(neither, "people", "said equally; they count in the share, not in the test"),
    )
    if not answered:
        return not_done(question, test, 0, "nobody answered", left_out=left_out)
    share = share_estimate(first, answered, f"chose {names[0]}")
    if not decided:
        made = not_done(question, test, answered, "nobody decided", left_out=left_out)
        return Finding(question=made.question, test=test, n=answered, estimate=share,
                       left_out=left_out, note=made.note)  # fmt: skip
    found: Any = stats.binomtest(first, decided, 0.5)
    return Finding(
        question=question,
        test=test,
        n=answered,
        symbol="k",
        statistic=float(first),
        p=float(found.pvalue),
        estimate=share,
        effect=share_estimate(first, decided, f"{names[0]} among those who decided"),
        left_out=left_out,
    )
