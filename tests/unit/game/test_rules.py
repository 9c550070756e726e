"""The numbers of the paper's scoring rule."""

import msgspec
import numpy as np
import pytest

from shared.game.rules import (
    RuleBook,
    attack_points,
    camping_points,
    count_camping,
    is_camping_paid,
)


def points(a_in: bool, contact: bool, camping: int, rules: RuleBook | None = None) -> float:
    rules = rules or RuleBook()
    found = attack_points(np.array([a_in]), np.array([contact]), rules)
    found += camping_points(np.array([camping], np.int32), rules)
    return float(found[0])


def test_a_step_in_the_target_gives_one_point():
    assert points(True, False, 0) == 1.0


def test_contact_inside_the_target_costs_ten_points():
    assert points(True, True, 0) == -10.0


def test_contact_outside_the_target_costs_nothing():
    assert points(False, True, 0) == 0.0


def test_two_hundred_steps_in_the_target_are_free_and_every_further_one_pays():
    assert [points(False, False, n) for n in (199, 200, 201, 202, 900)] == [0, 0, 10, 10, 10]


def test_camping_pays_beside_attack_and_penalty():
    assert points(True, False, 201) == 11.0
    assert points(True, True, 201) == 0.0


def test_once_pays_on_the_first_step_past_each_two_seconds():
    rules = RuleBook(camping="once")
    paid = [n for n in range(1000) if points(False, False, n, rules)]
    assert paid == [201, 401, 601, 801]


def test_once_with_one_free_step_pays_on_every_step_after_it():
    rules = RuleBook(camping="once", camping_steps=1)
    camping = np.arange(6, dtype=np.int32)
    assert is_camping_paid(camping, rules).tolist() == [False, False, True, True, True, True]


def test_leaving_the_target_starts_the_count_anew():
    camping = np.zeros(1, np.int32)
    counts = []
    for inside in (True, True, False, True):
        camping = count_camping(camping, np.array([inside]))
        counts.append(int(camping[0]))
    assert counts == [1, 2, 0, 1]
    assert camping.dtype == np.int32


@pytest.mark.parametrize("field", ["camping_steps", "bout_steps"])
def test_a_length_below_one_is_refused_by_name(field: str):
    with pytest.raises(ValueError, match=rf"{field} \(0\) must be at least 1"):
        RuleBook(**{field: 0})


def test_an_unknown_rule_is_refused():
    with pytest.raises(msgspec.ValidationError, match="camping_stepz"):
        msgspec.convert({"camping_stepz": 1}, RuleBook)
