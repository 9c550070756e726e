"""Learning as a straight line: score on game number, of everybody together and of each person.

The paper fits one line through all games of all people. Its p takes games of one person for games
of different people, so the same line is given with standard errors clustered by person, and the
slopes of single people, which are independent, are what conditions are compared by.
"""

# pyright: basic
# (scipy's and statsmodels' types are partial)

from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray
from scipy import stats
from statsmodels.regression.linear_model import OLS
from statsmodels.stats.diagnostic import het_breuschpagan
from statsmodels.tools.tools import add_constant

from shared.study.analysis.correlation import spearman
from shared.study.analysis.finding import Check, Estimate, Finding, check, missing_text, not_done
from shared.study.analysis.intervals import TAIL, correlation_estimate
from shared.study.analysis.paired import (
    FEWEST,
    NOTHING_VARIES,
    Named,
    normality,
    one_sample,
    paired,
)

Floats = NDArray[np.float64]
FEWEST_GAMES = 3
"""Of one person, below which it has no slope."""
SLOPE = "slope"


def pooled(games: Floats, cube: Floats, question: str) -> Finding:
    """Return the paper's regression: one line through every game of everybody.

    Args:
        games: float64[k], game numbers.
        cube: float64[n, k], scores, a row a person; NaN where a game is missing.
        question: what is asked.
    """
    test = "linear regression, all games"
    there = np.isfinite(cube)
    person, column = np.nonzero(there)
    x, y = games[column], cube[there]
    n = len(y)
    left_out = missing_text(cube.size - n, "games", "no score")
    if n < FEWEST + 1 or np.ptp(x) == 0.0 or np.ptp(y) == 0.0:
        why = "too few games, or nothing varies"
        return not_done(question, test, n, why, unit="games", left_out=left_out)
    line: Any = stats.linregress(x, y)
    half = float(stats.t.ppf(1.0 - TAIL, n - 2)) * float(line.stderr)
    slope = float(line.slope)
    residuals = y - (line.intercept + slope * x)
    return Finding(
        question=question,
        test=test,
        n=n,
        unit="games",
        symbol="t",
        statistic=slope / float(line.stderr) if line.stderr > 0.0 else None,
        df=(n - 2.0,),
        p=float(line.pvalue),
        estimate=Estimate(name=SLOPE, value=slope, low=slope - half, high=slope + half, method="t"),
        effect=correlation_estimate(float(line.rvalue), n, "r"),
        checks=(*normality(residuals, "residuals are normal"), *_equal_variance(x, residuals)),
        beside=(
            _clustered(x, y, person, question),
            spearman(x, y, question, unit="games"),
        ),
        left_out=left_out,
        note="games of one person are taken as independent, as the paper does",
    )


def person_slopes(games: Floats, cube: Floats) -> Floats:
    """Return float64[n], each person's slope; NaN with fewer than three games.

    Args:
        games: float64[k], game numbers.
        cube: float64[n, k], scores; NaN where a game is missing.
    """
    there = np.isfinite(cube)
    count = there.sum(axis=1)
    x = np.where(there, games, 0.0)
    y = np.where(there, cube, 0.0)
    with np.errstate(invalid="ignore", divide="ignore"):
        centred = np.where(there, games - (x.sum(axis=1) / count)[:, None], 0.0)
        slopes = (centred * y).sum(axis=1) / (centred**2).sum(axis=1)
    return np.where(count >= FEWEST_GAMES, slopes, np.nan)


def mean_slope(games: Floats, cube: Floats, question: str) -> Finding:
    """Return whether people's own slopes are above or below zero on average."""
    named = Named(question, "mean slope", "one-sample t-test of slopes")
    return one_sample(person_slopes(games, cube), named)


def compare_slopes(games: Floats, first: Floats, second: Floats, question: str) -> Finding:
    """Return whether people learn faster in the first condition than in the second, within people.

    Args:
        games: float64[k], game numbers.
        first: float64[n, k], scores; NaN where a game is missing.
        second: float64[n, k], of the same people.
        question: what is asked.
    """
    one, two = person_slopes(games, first), person_slopes(games, second)
    named = Named(question, "difference of slopes", "paired t-test of slopes")
    found = paired(one, two, named)
    if found.p is None:
        return found
    more = welch(one[np.isfinite(one)], two[np.isfinite(two)], question)
    return msgspec.structs.replace(found, beside=(*found.beside, more))


def welch(first: Floats, second: Floats, question: str) -> Finding:
    """Return Welch's t-test of two groups' means, and whether their variances differ.

    Args:
        first: float64[n], finite.
        second: float64[m], finite.
        question: what is asked.
    """
    test, n = "Welch t-test", len(first) + len(second)
    if min(len(first), len(second)) < 2 or np.ptp(first) + np.ptp(second) == 0.0:
        return not_done(question, test, n, "a group has fewer than 2 values, or nothing varies")
    found: Any = stats.ttest_ind(first, second, equal_var=False)
    interval = found.confidence_interval(1.0 - 2.0 * TAIL)
    difference = float(first.mean() - second.mean())
    pooled_sd = np.sqrt((first.var(ddof=1) + second.var(ddof=1)) / 2.0)
    return Finding(
        question=question,
        test=test,
        n=n,
        unit="values",
        symbol="t",
        statistic=float(found.statistic),
        df=(float(found.df),),
        p=float(found.pvalue),
        estimate=Estimate(
            name="difference of means", value=difference, low=float(interval.low),
            high=float(interval.high), method="t",
        ),
        effect=Estimate(name="d", value=difference / float(pooled_sd)),
        checks=_levene(first, second),
        note="people are taken as two groups; equal variances are not assumed",
    )  # fmt: skip


def _levene(first: Floats, second: Floats) -> tuple[Check, ...]:
    """Return the test of equal variance; nothing where no distance from a median varies."""
    away = [np.abs(group - np.median(group)) for group in (first, second)]
    if all(np.ptp(each) <= NOTHING_VARIES * max(1.0, float(each.max())) for each in away):
        return ()
    found: Any = stats.levene(first, second, center="median")
    test = "Levene (median)"
    return (check("variances are equal", test, float(found.statistic), float(found.pvalue)),)


def _clustered(x: Floats, y: Floats, person: NDArray[np.intp], question: str) -> Finding:
    """Return the same line with errors clustered by person (sandwich, t of people - 1)."""
    test = "the same line, errors clustered by person"
    people = len(np.unique(person))
    if people < FEWEST:
        return not_done(question, test, people, f"{people} people, it needs {FEWEST}")
    fit: Any = OLS(y, add_constant(x)).fit(
        cov_type="cluster", cov_kwds={"groups": person, "df_correction": True}, use_t=True
    )
    slope = float(fit.params[1])
    if not fit.cov_params()[1, 1] > (NOTHING_VARIES * max(1.0, abs(slope))) ** 2:
        return not_done(question, test, people, "people are all alike, nothing varies")
    low, high = fit.conf_int(2.0 * TAIL)[1]
    return Finding(
        question=question,
        test=test,
        n=people,
        symbol="t",
        statistic=float(fit.tvalues[1]),
        df=(people - 1.0,),
        p=float(fit.pvalues[1]),
        estimate=Estimate(
            name=SLOPE, value=slope, low=float(low), high=float(high),
            method="cluster sandwich",
        ),
    )  # fmt: skip


def _equal_variance(x: Floats, residuals: Floats) -> tuple[Check, ...]:
    if np.ptp(residuals) == 0.0:
        return ()
    statistic, p, _, _ = het_breuschpagan(residuals, add_constant(x))
    return (check("variance is equal along the line", "Breusch-Pagan", float(statistic), float(p)),)
