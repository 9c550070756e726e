"""Analysis of variance with repeated measures over one factor, and Friedman's test beside it."""

# pyright: basic
# (scipy's, pandas' and statsmodels' types are partial)

import dataclasses

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy import stats
from statsmodels.stats.anova import AnovaRM

from shared.study.analysis.finding import Check, Finding, check, missing_text, not_done
from shared.study.analysis.intervals import partial_eta_squared, resampled
from shared.study.analysis.paired import FEWEST, NOTHING_VARIES, normality

Floats = NDArray[np.float64]


@dataclasses.dataclass(frozen=True)
class Sphericity:
    """How far the differences between levels are from having one variance."""

    epsilon: float
    """Greenhouse and Geisser's, 1 / (k - 1) to 1: what degrees of freedom are multiplied by."""
    mauchly: Check | None
    """None below three levels, or with as few people as levels."""


def repeated_anova(cube: Floats, question: str, generator: np.random.Generator) -> Finding:
    """Return whether k levels differ within people; p is Greenhouse and Geisser's.

    The correction is always made: deciding on it by a test of sphericity would be a second test
    with little power in small studies (Howell 2013, Statistical Methods for Psychology, 14.7).

    Args:
        cube: float64[n, k], a row a person; a row with a NaN is left out.
        question: what is asked.
        generator: draws the bootstrap of Kendall's W.
    """
    test = "repeated-measures ANOVA"
    whole = cube[np.isfinite(cube).all(axis=1)]
    n, k = whole.shape
    left_out = missing_text(len(cube) - n, "people", "not every level was measured")
    if n < FEWEST or k < 2:
        why = f"{n} complete people and {k} levels, it needs {FEWEST} and 2"
        return not_done(question, test, n, why, left_out=left_out)
    residuals = whole - whole.mean(axis=1, keepdims=True) - whole.mean(axis=0) + whole.mean()
    if float(np.ptp(residuals)) <= NOTHING_VARIES * max(1.0, float(np.abs(whole).max())):
        return not_done(question, test, n, "nothing varies within people", left_out=left_out)
    f = _f_statistic(whole)
    df = (k - 1.0, (k - 1.0) * (n - 1.0))
    shape = sphericity(whole)
    corrected = (df[0] * shape.epsilon, df[1] * shape.epsilon)
    plain = float(stats.f.sf(f, *df))
    return Finding(
        question=question,
        test=test,
        n=n,
        symbol="F",
        statistic=f,
        df=corrected,
        p=float(stats.f.sf(f, *corrected)),
        effect=partial_eta_squared(f, df),
        checks=(
            *normality(residuals.ravel(), "residuals are normal"),
            *(() if shape.mauchly is None else (shape.mauchly,)),
        ),
        beside=(friedman(whole, question, generator),),
        left_out=left_out,
        note=(
            f"Greenhouse-Geisser epsilon {shape.epsilon:.3f}; uncorrected "
            f"F({df[0]:.0f}, {df[1]:.0f}), p = {plain:.4g}"
        ),
    )


def friedman(whole: Floats, question: str, generator: np.random.Generator) -> Finding:
    """Return Friedman's rank test with Kendall's W.

    Args:
        whole: float64[n, k], complete.
        question: what is asked.
        generator: draws the bootstrap of W.
    """
    test = "Friedman"
    n, k = whole.shape
    ranks = stats.rankdata(whole, axis=1)
    if n < FEWEST or k < 2 or not np.ptp(ranks, axis=1).any():
        return not_done(question, test, n, "too few people, or all values tie")
    statistic = n * (k - 1.0) * float(kendall_w(ranks[None])[0])
    if k > 2:  # scipy wants three levels; with two the formula above is the sign test's
        statistic = float(stats.friedmanchisquare(*whole.T).statistic)
    return Finding(
        question=question,
        test=test,
        n=n,
        symbol="chi2",
        statistic=statistic,
        df=(k - 1.0,),
        p=float(stats.chi2.sf(statistic, k - 1)),
        effect=resampled(ranks, kendall_w, generator, "Kendall's W"),
    )


def kendall_w(ranks: Floats) -> Floats:
    """Return float64[R], the agreement of people, 0 to 1, corrected for ties.

    Args:
        ranks: float64[R, n, k], each row ranked 1 to k.
    """
    _, n, k = ranks.shape
    sums = ranks.sum(axis=1)
    spread = ((sums - sums.mean(axis=1, keepdims=True)) ** 2).sum(axis=1)
    within = ((ranks - (k + 1.0) / 2.0) ** 2).sum(axis=(1, 2))
    with np.errstate(invalid="ignore", divide="ignore"):
        return spread / (n * within)


def sphericity(whole: Floats) -> Sphericity:
    """Return Greenhouse and Geisser's epsilon and Mauchly's test.

    Args:
        whole: float64[n, k], complete.
    """
    n, k = whole.shape
    contrasts = np.linalg.qr(np.column_stack([np.ones(k), np.eye(k)[:, : k - 1]]))[0][:, 1:]
    covariance = contrasts.T @ np.cov(whole, rowvar=False) @ contrasts
    p = k - 1
    epsilon = float(np.trace(covariance) ** 2 / (p * np.sum(covariance**2)))
    if k < 3 or n <= k:
        return Sphericity(epsilon, None)
    sign, log_determinant = np.linalg.slogdet(covariance)
    if sign <= 0:
        return Sphericity(epsilon, None)
    log_w = float(log_determinant - p * np.log(np.trace(covariance) / p))
    scale = 1.0 - (2.0 * p**2 + p + 2.0) / (6.0 * p * (n - 1.0))  # Box 1949
    statistic = -(n - 1.0) * scale * log_w
    df = p * (p + 1) // 2 - 1
    found = check(
        "sphericity", "Mauchly", float(np.exp(log_w)), float(stats.chi2.sf(statistic, df))
    )
    return Sphericity(epsilon, found)


def _f_statistic(whole: Floats) -> float:
    n, k = whole.shape
    frame = pd.DataFrame(
        {
            "value": whole.ravel(),
            "person": np.repeat(np.arange(n), k),
            "level": np.tile(np.arange(k), n),
        }
    )
    table = AnovaRM(frame, "value", "person", within=["level"]).fit().anova_table
    return float(table["F Value"].iloc[0])
