"""Studies in which nothing happens: how often each test says that something did, at 5 %.

And studies with known effects: how often each interval holds the truth, at 95 %. The quick tier
draws few studies and catches gross errors; the slow tier draws a thousand and more. A rate is
nominal where four standard errors of a binomial reach it: bounds come of the nominal rate, never of
what was measured.
"""

import numpy as np
import pytest
from scipy import stats

from shared.study.analysis.correlation import pearson, within_people
from shared.study.analysis.counts import choice, cronbach_alpha
from shared.study.analysis.intervals import share_estimate
from shared.study.analysis.mixed import mixed_slopes
from shared.study.analysis.paired import Named, holm, paired
from shared.study.analysis.regression import compare_slopes, mean_slope, pooled
from shared.study.analysis.repeated import repeated_anova
from shared.study.analysis.shuffles import shuffled_variance
from shared.study.analysis.switch import switch_effect
from shared.study.analysis.variances import compare_variances
from tests.unit.study_analysis.made import switched

NAMED = Named("does it differ?")
GAMES = np.arange(1.0, 11.0)
FEW, MANY = 6, 1200
COUNTS = [pytest.param(FEW, id="few"), pytest.param(MANY, id="many", marks=pytest.mark.slow)]


def people(generator, n, k, between=150.0, within=100.0):
    """Return float64[n, k], scores of people who differ and games that do not."""
    return generator.normal(350.0, between, (n, 1)) + generator.normal(0.0, within, (n, k))


def slack(rate, count):
    """Return four standard errors of a share of ``count`` studies."""
    return 4.0 * np.sqrt(rate * (1.0 - rate) / count)


def two_slopes(generator):
    """Return the scores of two conditions of study two, people learning at their own pace."""
    pace = generator.normal(20.0, 10.0, (10, 1))
    return [
        people(generator, 10, 10) + (pace + generator.normal(0.0, 8.0, (10, 1))) * GAMES
        for _ in range(2)
    ]


def paced(generator):
    """Return the scores of people who learn or unlearn at their own pace, on average not at all."""
    return people(generator, 10, 10) + generator.normal(0.0, 15.0, (10, 1)) * GAMES


def _pairs(generator):
    found = paired(*people(generator, 16, 2).T, NAMED)
    points = paired(*generator.integers(1, 6, (2, 16)).astype(float), NAMED)
    return {
        "paired t": found.p,
        "Wilcoxon": found.beside[0].p,
        "Shapiro-Wilk": found.checks[0].p,
        "paired t, five points": points.p,
        "at most: Wilcoxon, five points": points.beside[0].p,
    }


def _levels(generator):
    found = repeated_anova(people(generator, 16, 4), "q", generator)
    noise = generator.normal(0.0, 1.0, (16, 4)) * [0.0, 50.0, 200.0, 400.0]
    uneven = repeated_anova(people(generator, 16, 4) + noise, "q", generator)
    return {
        "ANOVA": float(stats.f.sf(found.statistic, 3, 45)),
        "at most: ANOVA, Greenhouse-Geisser": found.p,
        "at most: ANOVA, not spherical": uneven.p,
        "at most: Friedman": found.beside[0].p,
        "Mauchly": found.checks[1].p,
    }


def _lines(generator):
    alike = pooled(GAMES, people(generator, 10, 10, between=0.0), "q")
    own = pooled(GAMES, paced(generator), "q")
    return {
        "regression, all games": alike.p,
        "at most: Breusch-Pagan": alike.checks[1].p,
        "Spearman, all games": alike.beside[1].p,
        "regression, clustered": own.beside[0].p,
        "slopes of people": mean_slope(GAMES, paced(generator), "q").p,
    }


def _compared(generator):
    groups = compare_slopes(GAMES, paced(generator), paced(generator), "q").beside[1]
    return {
        "slopes compared": compare_slopes(GAMES, *two_slopes(generator), "q").p,
        "slopes compared, Welch": groups.p,
        "at most: Levene": groups.checks[0].p,
    }


def _correlations(generator):
    found = pearson(generator.normal(size=16), generator.normal(size=16), "q")
    first, second = people(generator, 16, 4), people(generator, 16, 4)
    return {
        "Pearson": found.p,
        "Spearman": found.beside[0].p,
        "correlation within people": within_people(first, second, "q").p,
    }


def _rest(generator):
    count = int(generator.binomial(10, 0.5))
    variance = generator.normal(0.0, 1.0, (10, 20)).var(axis=1, ddof=1)[:, None]
    found = compare_variances(variance[:5], variance[5:], ["q"])[0]
    return {
        "at most: exact binomial": choice(count, 10 - count, 0, 0, ("a", "b"), "q").p,
        "log variances": found.p,
        "at most: Mann-Whitney": found.beside[0].p,
    }


def _family(generator):
    family = holm([paired(*people(generator, 10, 2).T, NAMED) for _ in range(7)])
    return {"any of seven, Holm": min(finding.p_adjusted for finding in family)}


def _switches(generator):
    def orders(first, free, count):
        return [first + "".join(generator.permutation(list(free))) for _ in range(count)]

    easy_first = switched(generator, (600.0, 300.0, 350.0, 250.0), 1, orders("a", "bcd", 16), 5)
    uneven = switched(generator, (300.0, 700.0), 0, ["ab"] * 7 + ["ba"] * 3, 10, pace=20.0)
    return {
        "switch of the opponent, the first easier": switch_effect(easy_first).p,
        "switch of the opponent, uneven orders": switch_effect(uneven).p,
    }


NULL_STUDIES = (_pairs, _levels, _lines, _compared, _correlations, _rest, _family, _switches)
"""p of each test in a study in which nothing happens; "at most" where a test is discrete, or known
to be cautious with few people: then at most the nominal rate is what it promises."""


@pytest.mark.timeout(900)
@pytest.mark.parametrize("count", COUNTS)
@pytest.mark.parametrize("study", NULL_STUDIES)
def test_nothing_is_found_as_often_as_promised(study, count, record_property):
    generator = np.random.default_rng(20211108)
    studies = [study(generator) for _ in range(count)]
    for name in studies[0]:
        rate = float(np.mean([found[name] < 0.05 for found in studies]))
        record_property(name, rate)
        assert rate <= 0.05 + slack(0.05, count), name
        if not name.startswith("at most"):
            assert rate >= 0.05 - slack(0.05, count), name


@pytest.mark.timeout(1800)
@pytest.mark.parametrize("count", [pytest.param(1000, marks=pytest.mark.slow)])
def test_the_mixed_model_finds_nothing_as_often_as_promised(count, record_property):
    generator = np.random.default_rng(5)
    found = [mixed_slopes(GAMES[:6], *(c[:8, :6] for c in two_slopes(generator)), "q").p
             for _ in range(count)]  # fmt: skip
    done = np.array([p for p in found if p is not None])
    record_property("mixed model", float(np.mean(done < 0.05)))
    assert len(done) > 0.9 * count  # what does not converge is left out, and that is rare
    assert np.mean(done < 0.05) <= 0.05 + slack(0.05, len(done))


@pytest.mark.parametrize(
    "count", [pytest.param(8, id="few"), pytest.param(1000, id="many", marks=pytest.mark.slow)]
)
def test_shuffled_games_find_no_more_than_promised_where_people_differ_in_mean_only(
    count, record_property
):
    generator = np.random.default_rng(6)
    values = [
        shuffled_variance(people(generator, 16, 20), generator, shuffles=199)[0].p
        for _ in range(count)
    ]
    record_property("shuffles", float(np.mean(np.array(values) < 0.05)))
    assert np.mean(np.array(values) < 0.05) <= 0.05 + slack(0.05, count)


def _holds(estimate, truth):
    return estimate.low <= truth <= estimate.high


def _dz(generator):
    return _holds(paired(generator.normal(0.8, 1.0, 12), np.zeros(12), NAMED).effect, 0.8)


def _mean(generator):
    return _holds(paired(generator.normal(30.0, 80.0, 10), np.zeros(10), NAMED).estimate, 30.0)


def _median(generator):
    values = generator.logistic(30.0, 80.0, 12)
    return _holds(paired(values, np.zeros(12), NAMED).beside[0].estimate, 30.0)


def _pooled_slope(generator):
    cube = people(generator, 10, 10, between=0.0) + 30.0 * GAMES
    return _holds(pooled(GAMES, cube, "q").estimate, 30.0)


def _clustered_slope(generator):
    return _holds(pooled(GAMES, paced(generator) + 30.0 * GAMES, "q").beside[0].estimate, 30.0)


def _slope_difference(generator):
    steep, flat = two_slopes(generator)
    return _holds(compare_slopes(GAMES, steep + 14.3 * GAMES, flat, "q").estimate, 14.3)


def _eta(generator):
    """Return whether the interval of the effect of an ANOVA holds that of the population."""
    shift = np.array([0.0, 40.0, 80.0, 40.0])
    cube = people(generator, 16, 4) + shift
    noncentrality = 16 * np.sum((shift - shift.mean()) ** 2) / 100.0**2
    truth = noncentrality / (noncentrality + 3 + 45 + 1)
    return _holds(repeated_anova(cube, "q", generator).effect, truth)


def _correlation(generator, beside=False):
    x = generator.normal(size=16)
    y = 0.6 * x + 0.8 * generator.normal(size=16)
    found = pearson(x, y, "q")
    if beside:  # Spearman's of a normal pair
        return _holds(found.beside[0].effect, 6.0 / np.pi * np.arcsin(0.3))
    return _holds(found.effect, 0.6)


def _within(generator):
    x = people(generator, 16, 4)
    y = people(generator, 16, 4, within=80.0)
    own = (x - x.mean(axis=1, keepdims=True)) * 0.6
    return _holds(within_people(x, y + own, "q").effect, 0.6)


def _switch(generator):
    orders = ["a" + "".join(generator.permutation(list("bcd"))) for _ in range(16)]
    games = switched(generator, (600.0, 300.0, 350.0, 250.0), 1, orders, 5, drop=80.0)
    return _holds(switch_effect(games).estimate, -80.0)


def _alpha(generator):
    truth = 5 * 0.5 / (1 + 4 * 0.5)
    items = generator.normal(size=(16, 1)) + generator.normal(size=(16, 5))
    return _holds(cronbach_alpha(items), truth)


def _ratio(generator):
    one = 1.5 * generator.normal(size=(5, 20)).var(axis=1, ddof=1)
    two = generator.normal(size=(5, 20)).var(axis=1, ddof=1)
    return _holds(compare_variances(one[:, None], two[:, None], ["q"])[0].estimate, 1.5)


COVERED = {
    "mean difference": _mean,
    "d_z": _dz,
    "Hodges-Lehmann": _median,
    "slope, all games": _pooled_slope,
    "slope, clustered": _clustered_slope,
    "difference of slopes": _slope_difference,
    "switch of the opponent": _switch,
    "partial eta squared": _eta,
    "Pearson's r": _correlation,
    "Spearman's rho": lambda generator: _correlation(generator, beside=True),
    "r within people": _within,
    "Cronbach's alpha": _alpha,
    "ratio of variances": _ratio,
    "share": lambda generator: _holds(
        share_estimate(int(generator.binomial(10, 0.7)), 10, "share"), 0.7
    ),
}


@pytest.mark.timeout(600)
@pytest.mark.parametrize("count", COUNTS)
@pytest.mark.parametrize("name", COVERED)
def test_known_effects_are_in_their_intervals_as_often_as_promised(name, count, record_property):
    generator = np.random.default_rng(8)
    covered = float(np.mean([COVERED[name](generator) for _ in range(count)]))
    record_property(name, covered)
    assert covered >= 0.95 - slack(0.05, count)
    if name not in ("share", "Hodges-Lehmann"):  # discrete: at least nominal
        assert covered <= 0.95 + slack(0.05, count)
