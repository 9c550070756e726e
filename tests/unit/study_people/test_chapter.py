from types import MappingProxyType

import numpy as np
import pytest

from shared.study.analysis.chapters.learning import learning_chapter
from shared.study.analysis.games import Games
from shared.study.analysis.power import plan
from shared.study.analysis.switch import switch_effect
from shared.study.people.attitudes import SIMULATED_TEXT, choices, points, ranks, words
from shared.study.people.chapter import (
    NOT_PEOPLE,
    rehearsal_chapter,
    slope_question,
)
from shared.study.people.population import Population, draw
from shared.study.protocol import Item


def played(slopes: tuple[float, float], drop: float, noise: float = 10.0) -> Games:
    """Return 12 people's games, half of them in either order; a switch costs ``drop`` points."""
    rng = np.random.default_rng(1)
    numbers = np.arange(1.0, 11.0)
    by_condition = np.array(
        [
            [level + slope * numbers for level, slope in zip((300.0, 900.0), slopes, strict=True)]
            for _ in range(12)
        ]
    )
    by_condition += noise * rng.standard_normal(by_condition.shape)
    orders = {f"sub-{k + 1:02d}": ("a", "b") if k % 2 else ("b", "a") for k in range(12)}
    by_section = np.empty_like(by_condition)
    for k, order in enumerate(orders.values()):
        for section, name in enumerate(order):
            condition = "ab".index(name)
            if section:
                by_condition[k, condition] -= drop
            by_section[k, section] = by_condition[k, condition]
    return Games(
        people=tuple(orders), conditions=("a", "b"), first=(), by_section=by_section,
        by_condition=by_condition, orders=orders, bouts=MappingProxyType({}), left_out=(),
    )  # fmt: skip


def test_who_learns_faster_against_the_first_is_found_with_its_interval():
    found = slope_question(played((30.0, 15.7), 0.0), ("a", "b"))
    assert found.estimate is not None
    assert found.estimate.low is not None
    assert found.estimate.low < 14.3 < (found.estimate.high or 0.0)
    assert found.is_significant


def test_a_drop_at_the_switch_is_found_whatever_the_opponents_difficulty():
    dropped = switch_effect(played((0.0, 0.0), 200.0))
    assert dropped.estimate is not None
    assert dropped.estimate.value == pytest.approx(-200.0, abs=15.0)
    still = switch_effect(played((0.0, 0.0), 0.0))
    assert not still.is_significant


def test_a_rehearsals_report_gives_one_answer_about_the_switch():
    games = played((5.0, 5.0), 100.0)
    people = tuple(draw(Population(), number, 1) for number in range(1, 13))
    rehearsal = rehearsal_chapter(games, Population(), people, None, "a", 1000.0)
    learning = learning_chapter(games, np.random.default_rng(0))
    assert learning is not None
    answers = [finding for chapter in (rehearsal, learning) for finding in chapter.findings
               if "switch" in finding.question]  # fmt: skip
    assert answers == [switch_effect(games)] * 2


def test_the_chapter_says_first_that_nobody_took_part_and_names_a_ceiling():
    games = played((30.0, 15.7), 0.0)
    people = tuple(draw(Population(), number, 1) for number in range(1, 13))
    planned = plan(
        games.numbers, games.by_condition[:, 0], games.by_condition[:, 1], 14.3, (4, 8), 100,
        np.random.default_rng(2),
    )  # fmt: skip
    chapter = rehearsal_chapter(games, Population(), people, planned, "a", 1000.0)
    assert chapter.says[0] == NOT_PEOPLE
    assert any("improve more slowly against b than against a" in words for words in chapter.says)
    assert any("Most games against b reach 90 %" in words for words in chapter.says)
    assert any("an assumption and no result" in words for words in chapter.says)
    assert [table.name for table in chapter.tables] == ["rehearsal", "simulated_people", "power"]


def test_answers_fit_their_items():
    rng, person = np.random.default_rng(3), draw(Population(), 1, 1)
    scale = Item(id="PU1", construct="PU", text="It is of use.")
    turned = Item(id="PU2", construct="PU", text="It is of no use.", is_reversed=True)
    values = [points(scale, person, 0.0, rng) for _ in range(200)]
    assert set(values) <= {1, 2, 3, 4, 5}
    keen = draw(Population(), 1, 1)
    keen = type(keen)(**{**{f: getattr(keen, f) for f in keen.__struct_fields__},
                         "enthusiasm": 1.5, "acquiescence": 0.0})  # fmt: skip
    agrees = np.mean([points(scale, keen, 0.0, rng) for _ in range(200)])
    assert agrees > 3.0 > np.mean([points(turned, keen, 0.0, rng) for _ in range(200)])
    why = Item(id="why", construct="open", text="Why?", scale="open")
    assert words(why, person) == SIMULATED_TEXT
    age = Item(id="age", construct="age", text="How old are you?", scale="open")
    assert 18 <= int(words(age, person)) <= 60
    several = Item(
        id="A", construct="A", text="Which?", scale="choices", options=("x", "y", "other"),
        is_several=True, other="other",
    )  # fmt: skip
    assert all(set(choices(several, rng)) <= {"x", "y"} for _ in range(50))
    order = Item(id="d", construct="d", text="Which was more difficult?", scale="ranking",
                 ends=("least", "most"))  # fmt: skip
    found = [ranks(order, (100.0, -900.0, 100.0), rng) for _ in range(100)]
    assert all(min(each) == 1 and max(each) <= 3 for each in found)
    assert np.mean([each[1] for each in found]) > np.mean([each[0] for each in found])
