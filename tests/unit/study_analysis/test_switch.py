"""What a switch of the opponent does, told from what an easier opponent does."""

import dataclasses

import numpy as np
import pytest
from scipy import stats

from shared.study.analysis.switch import switch_effect
from tests.unit.study_analysis.made import switched


def made(orders, levels=(300.0, 700.0), first=0, drop=0.0, games=10):
    return switched(np.random.default_rng(4), levels, first, orders, games, drop=drop)


def test_with_two_conditions_it_is_the_mean_of_both_orders_with_their_pooled_error():
    games = made(["ab"] * 7 + ["ba"] * 3)
    cube = games.by_section
    jumps = cube[:, 1, 0] - cube[:, 0, -1]
    values = jumps - (cube[:, :, -1] - cube[:, :, 0]).mean(axis=1) / 9.0
    one, two = values[:7], values[7:]
    pooled = (6 * one.var(ddof=1) + 2 * two.var(ddof=1)) / 8
    error = np.sqrt(pooled * (1 / 7 + 1 / 3)) / 2.0
    found = switch_effect(games)
    assert found.estimate.value == pytest.approx((one.mean() + two.mean()) / 2.0)
    assert found.statistic == pytest.approx(found.estimate.value / error)
    assert found.df == (8.0,)
    assert found.p == pytest.approx(2.0 * stats.t.sf(abs(found.statistic), 8))
    assert found.effect.value == pytest.approx(found.estimate.value / np.sqrt(pooled))


@pytest.mark.parametrize("levels", [(600.0, 300.0, 350.0, 250.0), (-900.0, 0.0, 500.0, 9000.0)])
def test_how_difficult_the_opponents_are_is_no_part_of_it(levels):
    orders = ["a" + free for free in ("bcd", "cdb", "dbc", "bdc", "dcb", "cbd") * 2]
    alike = switch_effect(made(orders, (0.0,) * 4, first=1, games=5))
    found = switch_effect(made(orders, levels, first=1, games=5))
    assert found.estimate.value == pytest.approx(alike.estimate.value)
    assert found.p == pytest.approx(alike.p)
    assert not found.is_significant


def test_the_section_that_everybody_begins_with_is_no_part_of_it():
    games = made(["abc", "acb"] * 6, (0.0, 100.0, 300.0), first=1, games=5)
    cube = games.by_section.copy()
    cube[:, 0] += 1000.0 * np.arange(5.0)
    steep = dataclasses.replace(games, by_section=cube)
    assert switch_effect(steep) == switch_effect(games)


def test_a_drop_is_found_in_its_size():
    found = switch_effect(made(["abc", "bca", "cab", "acb", "bac", "cba"] * 3, (0.0, 400.0, -90.0),
                               drop=200.0))  # fmt: skip
    assert found.is_significant
    assert found.estimate.low < -200.0 < found.estimate.high < 0.0


def test_where_everybody_has_one_order_no_test_is_done():
    found = switch_effect(made(["ab"] * 12))
    assert (found.n, found.p) == (12, None)
    assert "all orders are alike" in found.note


def test_too_few_people_are_said():
    assert "4 are needed" in switch_effect(made(["ab", "ba", "ab"])).note
    nobody = made([])
    assert switch_effect(nobody).n == 0


def test_who_played_on_one_side_of_the_switch_only_is_left_out():
    games = made(["ab", "ba"] * 5)
    cube = games.by_section.copy()
    cube[3, 1] = np.nan
    found = switch_effect(dataclasses.replace(games, by_section=cube))
    assert found.n == 9
    assert found.left_out == ("1 person left out: no games on both sides of a switch",)
