import dataclasses

import numpy as np
import pytest

from shared.styles.bouts import BoutTable
from shared.styles.payoff import payoff_of
from tests.unit.styles.making import RULES, table


def rows(made: BoutTable, keep: np.ndarray) -> BoutTable:
    arrays = {
        field.name: getattr(made, field.name)[keep]
        for field in dataclasses.fields(BoutTable)
        if isinstance(getattr(made, field.name), np.ndarray)
    }
    return dataclasses.replace(made, **arrays)


def test_a_payoff_is_the_mean_of_the_pairings_bouts_split_by_rule():
    made = table(2, 3, 5)
    payoff = payoff_of(made, np.random.default_rng(0))
    assert payoff.bouts.tolist() == [[5] * 3] * 2
    for one in range(2):
        for two in range(3):
            of = [k for k in range(30) if (made.antagonist[k], made.protagonist[k]) == (one, two)]
            scores = [float(made.score[k]) for k in of]
            camping = 10.0 * sum(int(made.camping_steps[k]) for k in of) / 5
            penalty = -10.0 * sum(int(made.penalty_steps[k]) for k in of) / 5
            attack = sum(int(made.attack_steps[k]) for k in of) / 5
            assert payoff.mean[one, two] == pytest.approx(sum(scores) / 5)
            assert payoff.mean[one, two] == pytest.approx(attack + penalty + camping)
            assert payoff.wins[one, two] == sum(score > 0 for score in scores)
            share = camping / (attack - penalty + camping)
            assert payoff.camping_share[one, two] == pytest.approx(share)
            inside = sum(int(made.attack_steps[k] + made.penalty_steps[k]) for k in of)
            assert payoff.in_target_share[one, two] == pytest.approx(inside / 5 / RULES.bout_steps)


def test_the_same_bouts_and_seed_give_the_same_intervals_in_any_order_of_the_bouts():
    made = table(3, 2, 20)
    one = payoff_of(made, np.random.default_rng(4))
    two = payoff_of(made, np.random.default_rng(4))
    assert one.low.tobytes() == two.low.tobytes()
    assert (one.low < one.mean).all()
    assert (one.mean < one.high).all()


def test_intervals_hold_the_true_mean_nineteen_times_in_twenty():
    held = 0
    for seed in range(60):
        made = table(2, 2, 60, seed=seed)
        payoff = payoff_of(made, np.random.default_rng(seed))
        true = np.mean(np.arange(900)) - 10 * np.mean(np.arange(60)) + 10 * np.mean(np.arange(20))
        held += int(((payoff.low <= true) & (true <= payoff.high)).sum())
    assert 0.90 <= held / 240 <= 0.99


def test_a_pairing_without_bouts_has_no_payoff_and_the_others_keep_theirs():
    made = table(2, 2, 4)
    some = rows(made, ~((made.antagonist == 1) & (made.protagonist == 0)))
    payoff = payoff_of(some, np.random.default_rng(0))
    assert not payoff.is_complete
    assert np.isnan(payoff.mean).tolist() == [[False, False], [True, False]]
    assert np.isnan(payoff.low).tolist() == [[False, False], [True, False]]
    whole = payoff_of(made, np.random.default_rng(0))
    assert whole.is_complete
    assert payoff.mean[0, 0] == whole.mean[0, 0]


def test_without_any_points_camping_has_no_share():
    made = table(1, 1, 3)
    zeros = np.zeros(3, np.int32)
    still = dataclasses.replace(
        made, score=zeros.astype(np.float32), attack_steps=zeros, penalty_steps=zeros,
        camping_steps=zeros,
    )  # fmt: skip
    payoff = payoff_of(still, np.random.default_rng(0))
    assert payoff.camping_share.tolist() == [[0.0]]
    assert payoff.mean.tolist() == payoff.low.tolist() == payoff.high.tolist() == [[0.0]]
    assert payoff.wins.tolist() == [[0]]  # nothing scored: the protagonist held
