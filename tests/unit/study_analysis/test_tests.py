"""Every test against the formula of its textbook, worked in numpy."""

import itertools

import numpy as np
import pytest
from scipy import stats
from statsmodels.stats.multitest import multipletests

from shared.study.analysis.correlation import pearson, spearman, within_people
from shared.study.analysis.counts import choice, cronbach_alpha, percentages
from shared.study.analysis.mixed import mixed_slopes
from shared.study.analysis.paired import (
    Named,
    hodges_lehmann,
    holm,
    one_sample,
    paired,
    pairwise,
    signed_rank,
)
from shared.study.analysis.regression import compare_slopes, person_slopes, pooled, welch
from shared.study.analysis.repeated import friedman, kendall_w, repeated_anova, sphericity

NAMED = Named("does it differ?")
GAMES = np.arange(1.0, 11.0)


def people(seed, n=10, k=10, slope=0.0, between=150.0, within=100.0):
    generator = np.random.default_rng(seed)
    rows = generator.normal(350.0, between, (n, 1)) + generator.normal(0.0, within, (n, k))
    return rows + slope * np.arange(1.0, k + 1.0)


def t_sides(t, df):
    return 2.0 * float(stats.t.sf(abs(t), df))


def test_the_paired_test_is_the_mean_difference_over_its_standard_error():
    first, second = people(1)[:, 0], people(2)[:, 0]
    found = paired(first, second, NAMED)
    difference = first - second
    error = np.sqrt(np.sum((difference - difference.mean()) ** 2) / 9.0) / np.sqrt(10.0)
    t = difference.mean() / error
    assert found.statistic == pytest.approx(t)
    assert found.p == pytest.approx(t_sides(t, 9))
    half = 2.262157 * error  # t(9) at 97.5 %, from a printed table
    assert found.estimate.low == pytest.approx(difference.mean() - half, rel=1e-6)
    assert found.estimate.high == pytest.approx(difference.mean() + half, rel=1e-6)
    assert found.effect.value == pytest.approx(difference.mean() / difference.std(ddof=1))


def test_the_interval_of_an_effect_size_leaves_a_fortieth_on_either_side():
    found = one_sample(people(3)[:, 0] - 300.0, NAMED)
    for end, area in ((found.effect.low, 0.975), (found.effect.high, 0.025)):
        grid = np.random.default_rng(0)
        # the noncentral t as what it is: a shifted normal over the root of a chi square
        drawn = (grid.normal(size=400_000) + end * np.sqrt(10.0)) / np.sqrt(
            grid.chisquare(9, 400_000) / 9.0
        )
        assert np.mean(drawn <= found.statistic) == pytest.approx(area, abs=0.002)


def test_a_person_without_both_values_is_left_out_and_named():
    first = np.array([1.0, 2.0, 4.0, np.nan, 8.0])
    found = paired(first, np.array([0.0, 3.0, 1.0, 1.0, np.nan]), NAMED)
    assert found.n == 3
    assert found.left_out == ("2 without a value left out: no complete pair or value",)


def test_equal_differences_are_no_test_but_a_finding():
    found = paired(np.ones(8), np.ones(8), NAMED)
    assert found.p is None
    assert found.note == "not done: all are zero"
    assert "not done" in paired(np.ones(8), np.zeros(8), NAMED).note
    assert "at least 3" in paired(np.ones(2), np.zeros(2), NAMED).note


def test_the_signed_rank_test_counts_all_patterns_of_signs():
    values = np.array([1.2, -0.4, 2.2, 3.1, -0.2, 0.9, 1.7])
    ranks = stats.rankdata(np.abs(values))
    smaller = min(ranks[values > 0].sum(), ranks[values < 0].sum())
    sums = [sum(itertools.compress(ranks, signs)) for signs in itertools.product((0, 1), repeat=7)]
    p = min(1.0, 2.0 * np.mean(np.array(sums) <= smaller))
    found = signed_rank(values, NAMED)
    assert found.p == pytest.approx(stats.wilcoxon(values).pvalue)
    assert found.statistic == smaller
    assert found.p == pytest.approx(p)
    assert found.effect.value == pytest.approx(1.0 - 2.0 * smaller / ranks.sum())


def test_the_signed_rank_test_is_exact_where_values_tie():
    values = np.array([1.0, 1.0, -1.0, 2.0, 0.0, 3.0, 3.0, -2.0])
    patterns = stats.PermutationMethod(n_resamples=1000)
    found = signed_rank(values, NAMED)
    assert found.p == pytest.approx(stats.wilcoxon(values[values != 0.0], method=patterns).pvalue)
    assert found.left_out == ("1 zero left out: they have no sign",)


def test_the_interval_of_the_signed_rank_test_ends_where_its_p_passes_a_twentieth():
    values = people(4)[:, 0] - 350.0
    found = hodges_lehmann(values)
    inside = signed_rank(values - found.low - 1e-6, NAMED).p
    outside = signed_rank(values - found.low + 1e-6, NAMED).p
    assert outside < 0.05 <= inside
    assert hodges_lehmann(values[:4]).low is None


def test_the_correction_for_many_tests_is_holms():
    cube = people(5, k=4)
    found = pairwise(cube, "abcd", "level")
    expected = multipletests([finding.p for finding in found], method="holm")[1]
    assert [finding.p_adjusted for finding in found] == pytest.approx(expected)
    assert {finding.family for finding in found} == {6}


def test_tests_that_were_not_done_are_not_counted_by_holm():
    real = [paired(people(k)[:, 0], people(k + 1)[:, 0], NAMED) for k in (6, 7)]
    nothing = paired(np.ones(5), np.ones(5), NAMED)
    found = holm([real[0], nothing, real[1]])
    assert [finding.family for finding in found] == [2, 0, 2]
    assert holm(real[:1])[0].p_adjusted is None


def test_repeated_measures_anova_is_the_ratio_of_its_mean_squares():
    cube = people(8, n=12, k=5)
    n, k = cube.shape
    grand = cube.mean()
    levels = n * np.sum((cube.mean(axis=0) - grand) ** 2)
    between = k * np.sum((cube.mean(axis=1) - grand) ** 2)
    error = np.sum((cube - grand) ** 2) - levels - between
    f = (levels / (k - 1)) / (error / ((k - 1) * (n - 1)))
    found = repeated_anova(cube, "games", np.random.default_rng(0))
    assert found.statistic == pytest.approx(f)
    assert found.effect.value == pytest.approx(levels / (levels + error))
    # Greenhouse & Geisser by Box's formula on the covariance, not by contrasts
    s = np.cov(cube, rowvar=False)
    top = (k * (np.trace(s) / k - s.mean())) ** 2
    rows = s.mean(axis=1)
    bottom = (k - 1) * (np.sum(s**2) - 2 * k * np.sum(rows**2) + k**2 * s.mean() ** 2)
    assert sphericity(cube).epsilon == pytest.approx(top / bottom)
    assert found.df == pytest.approx(np.array([k - 1, (k - 1) * (n - 1)]) * top / bottom)
    assert found.p == pytest.approx(float(stats.f.sf(f, *found.df)))


def test_the_anova_of_two_levels_is_the_paired_test_squared():
    cube = people(9, k=2)
    found = repeated_anova(cube, "two", np.random.default_rng(0))
    assert found.statistic == pytest.approx(paired(cube[:, 0], cube[:, 1], NAMED).statistic ** 2)
    assert found.df == pytest.approx((1.0, 9.0))


def test_mauchly_is_the_determinant_over_the_mean_variance_of_contrasts():
    cube = people(10, n=9, k=3)
    helmert = np.array([[1.0, -1.0, 0.0], [1.0, 1.0, -2.0]])
    helmert /= np.linalg.norm(helmert, axis=1, keepdims=True)
    s = helmert @ np.cov(cube, rowvar=False) @ helmert.T
    w = np.linalg.det(s) / (np.trace(s) / 2.0) ** 2
    found = sphericity(cube).mauchly
    assert found.statistic == pytest.approx(w)
    statistic = -(8 - (2 * 4 + 2 + 2) / 12.0) * np.log(w)
    assert found.p == pytest.approx(float(stats.chi2.sf(statistic, 2)))


def test_friedman_is_the_spread_of_rank_sums():
    cube = people(11, n=8, k=4)
    ranks = stats.rankdata(cube, axis=1)
    n, k = cube.shape
    chi2 = 12.0 / (n * k * (k + 1)) * np.sum(ranks.sum(axis=0) ** 2) - 3.0 * n * (k + 1)
    found = friedman(cube, "levels", np.random.default_rng(0))
    assert found.statistic == pytest.approx(chi2)
    assert found.effect.value == pytest.approx(chi2 / (n * (k - 1)))
    tied = np.round(ranks / 2.0)
    tied_ranks = stats.rankdata(tied, axis=1)
    expected = stats.friedmanchisquare(*tied.T).statistic / (n * (k - 1))
    assert kendall_w(tied_ranks[None])[0] == pytest.approx(expected)


def test_a_person_who_misses_a_level_is_left_out_of_the_anova():
    cube = people(12, n=6, k=3)
    cube[2, 1] = np.nan
    found = repeated_anova(cube, "levels", np.random.default_rng(0))
    whole = repeated_anova(np.delete(cube, 2, axis=0), "levels", np.random.default_rng(0))
    assert (found.n, found.statistic) == (5, whole.statistic)
    assert found.left_out == ("1 person left out: not every level was measured",)


def test_the_pooled_line_solves_the_normal_equations():
    cube = people(13, slope=20.0)
    cube[3, 4] = np.nan
    there = np.isfinite(cube)
    x, y = np.broadcast_to(GAMES, cube.shape)[there], cube[there]
    design = np.column_stack([np.ones(len(x)), x])
    inverse = np.linalg.inv(design.T @ design)
    a, b = inverse @ design.T @ y
    left = y - a - b * x
    error = np.sqrt(inverse[1, 1] * left @ left / (len(x) - 2))
    found = pooled(GAMES, cube, "learning")
    assert found.n == 99
    assert found.left_out == ("1 game left out: no score",)
    assert found.estimate.value == pytest.approx(b)
    assert found.statistic == pytest.approx(b / error)
    assert found.effect.value == pytest.approx(np.corrcoef(x, y)[0, 1])
    clustered = found.beside[0]
    person = np.nonzero(there)[0]
    meat = np.zeros((2, 2))
    for one in range(10):
        score = design[person == one].T @ left[person == one]
        meat += np.outer(score, score)
    correction = 10.0 / 9.0 * (len(x) - 1) / (len(x) - 2)
    sandwich = correction * inverse @ meat @ inverse
    assert clustered.statistic == pytest.approx(b / np.sqrt(sandwich[1, 1]))
    assert clustered.p == pytest.approx(t_sides(clustered.statistic, 9))


def test_the_check_of_equal_variance_is_lagrange_multiplier_of_squares_on_game():
    cube = people(14, slope=10.0)
    x, y = np.broadcast_to(GAMES, cube.shape).ravel(), cube.ravel()
    left = y - np.polyval(np.polyfit(x, y, 1), x)
    statistic = len(x) * np.corrcoef(x, left**2)[0, 1] ** 2
    found = next(c for c in pooled(GAMES, cube, "q").checks if c.test == "Breusch-Pagan")
    assert found.statistic == pytest.approx(statistic)
    assert found.p == pytest.approx(float(stats.chi2.sf(statistic, 1)))


def test_people_who_are_all_alike_have_no_line_clustered_by_person_and_warn_nobody():
    cube = np.tile(100.0 + GAMES, (3, 1))
    cube[:, 4] += 7.0  # off the line, everybody alike
    found = pooled(GAMES, cube, "q")
    assert found.estimate is not None
    assert found.beside[0].p is None
    assert found.beside[0].note == "not done: people are all alike, nothing varies"


def test_groups_of_two_have_no_check_of_variance_and_warn_nobody():
    found = welch(np.array([1.1, 3.4]), np.array([2.2, 8.7]), "q")
    assert found.p is not None
    assert found.checks == ()


def test_slopes_of_people_are_their_own_least_squares():
    cube = people(15, slope=5.0)
    cube[0, :4] = np.nan
    cube[1, 2:] = np.nan
    slopes = person_slopes(GAMES, cube)
    assert slopes[0] == pytest.approx(np.polyfit(GAMES[4:], cube[0, 4:], 1)[0])
    assert slopes[5] == pytest.approx(np.polyfit(GAMES, cube[5], 1)[0])
    assert np.isnan(slopes[1])


def test_slopes_are_compared_within_people_with_welch_beside():
    first, second = people(16, slope=30.0), people(17, slope=15.0)
    found = compare_slopes(GAMES, first, second, "who learns faster?")
    one, two = person_slopes(GAMES, first), person_slopes(GAMES, second)
    t = (one - two).mean() / ((one - two).std(ddof=1) / np.sqrt(10))
    assert found.statistic == pytest.approx(t)
    welch_t = (one.mean() - two.mean()) / np.sqrt(one.var(ddof=1) / 10 + two.var(ddof=1) / 10)
    assert found.beside[1].test == "Welch t-test"
    assert found.beside[1].statistic == pytest.approx(welch_t)
    assert [beside.test for beside in found.beside] == ["Wilcoxon signed-rank", "Welch t-test"]


def test_welch_has_its_own_degrees_of_freedom_and_checks_the_variances():
    one, two = people(18, n=8)[:, 0], people(19, n=14, between=20.0)[:, 0]
    parts = one.var(ddof=1) / 8, two.var(ddof=1) / 14
    found = welch(one, two, "groups")
    assert found.df[0] == pytest.approx(sum(parts) ** 2 / (parts[0] ** 2 / 7 + parts[1] ** 2 / 13))
    apart = [np.abs(group - np.median(group)) for group in (one, two)]
    f = stats.f_oneway(*apart).statistic
    assert found.checks[0].statistic == pytest.approx(f)


def test_the_mixed_model_agrees_with_the_test_of_slopes_in_a_whole_design():
    first, second = people(20, slope=30.0), people(21, slope=15.0)
    slopes = compare_slopes(GAMES, first, second, "q")
    found = mixed_slopes(GAMES, first, second, "q")
    assert found.estimate.value == pytest.approx(slopes.estimate.value, rel=1e-4)
    assert found.df in ((9.0,), (160.0,))
    assert found.p == pytest.approx(slopes.p, abs=0.1)


def test_the_mixed_model_has_the_paired_test_in_it_where_people_differ_in_slope():
    generator = np.random.default_rng(3)
    first, second = (
        people(seed, between=20.0, within=30.0) + generator.normal(0.0, 40.0, (10, 1)) * GAMES
        for seed in (1, 2)
    )
    slopes = compare_slopes(GAMES, first, second, "q")
    found = mixed_slopes(GAMES, first, second, "q")
    assert found.df == (9.0,)
    assert found.statistic == pytest.approx(slopes.statistic, rel=0.02)
    assert found.p == pytest.approx(slopes.p, abs=0.01)


def test_a_mixed_model_that_cannot_be_fitted_is_said_so():
    nothing = np.full((10, 10), np.nan)
    assert mixed_slopes(GAMES, nothing, nothing, "q").p is None


def test_pearson_and_spearman_are_their_formulas():
    x, y = people(22)[:, 0], people(23)[:, 0]
    r = np.sum((x - x.mean()) * (y - y.mean())) / (9 * x.std(ddof=1) * y.std(ddof=1))
    found = pearson(x, y, "q")
    assert found.statistic == pytest.approx(r)
    assert found.p == pytest.approx(t_sides(r * np.sqrt(8 / (1 - r * r)), 8))
    half = 1.959964 / np.sqrt(7.0)
    assert np.arctanh(found.effect.high) == pytest.approx(np.arctanh(r) + half, rel=1e-6)
    distance = np.sum((stats.rankdata(x) - stats.rankdata(y)) ** 2)
    assert spearman(x, y, "q").statistic == pytest.approx(1.0 - 6.0 * distance / (10 * 99))
    assert pearson(np.ones(10), y, "q").p is None


def test_correlation_within_people_is_that_of_an_analysis_of_covariance():
    first, second = people(24, n=6, k=4), people(25, n=6, k=4)
    second[1, 2] = np.nan
    there = np.isfinite(second)
    person = np.nonzero(there)[0]
    dummies = (person[:, None] == np.arange(6)).astype(float)
    x, y = first[there], second[there]
    left = [v - dummies @ np.linalg.lstsq(dummies, v, rcond=None)[0] for v in (x, y)]
    found = within_people(first, second, "q")
    assert found.statistic == pytest.approx(np.corrcoef(*left)[0, 1])
    assert found.df == (23 - 6 - 1,)
    slope, *_ = np.linalg.lstsq(np.column_stack([dummies, x]), y, rcond=None)
    residual = y - np.column_stack([dummies, x]) @ slope
    error = np.sqrt(residual @ residual / 16 / (left[0] @ left[0]))
    assert found.p == pytest.approx(t_sides(slope[-1] / error, 16))


def test_percentages_leave_out_who_did_not_answer():
    answers = np.array([2.0] + [3.0] * 4 + [4.0] * 6 + [5.0] * 5 + [np.nan])
    assert percentages(answers, 5).tolist() == [0.0, 6.25, 25.0, 37.5, 31.25]


def test_alpha_is_one_for_copies_and_by_hand_for_two_items():
    base = people(26)[:, :1]
    assert cronbach_alpha(np.hstack([base, base, base])).value == pytest.approx(1.0)
    items = np.array([[1.0, 2.0], [2.0, 2.0], [3.0, 5.0], [5.0, 4.0]])
    # variances 35/12, 9/4; of the sum 83/12... by hand: 2 (1 - (2.9167 + 2.25) / 8.9167)
    total = items.sum(axis=1).var(ddof=1)
    assert cronbach_alpha(items).value == pytest.approx(2 * (1 - (35 / 12 + 9 / 4) / total))
    assert cronbach_alpha(items[:, :1]) is None


def test_a_choice_counts_the_undecided_in_the_share_but_not_in_the_test():
    found = choice(7, 2, 1, 0, ("RL", "baseline"), "more intelligent?")
    assert (found.n, found.estimate.value) == (10, 0.7)
    tail = sum(stats.binom.pmf(k, 9, 0.5) for k in (0, 1, 2, 7, 8, 9))
    assert found.p == pytest.approx(tail)
    # Clopper & Pearson: at the lower end, 7 or more of 10 has a chance of a fortieth
    assert stats.binom.sf(6, 10, found.estimate.low) == pytest.approx(0.025)
    assert stats.binom.cdf(7, 10, found.estimate.high) == pytest.approx(0.025)
    assert choice(0, 0, 3, 1, ("RL", "baseline"), "q").note == "not done: nobody decided"
