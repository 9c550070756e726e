"""Draws follow their distribution, and nothing but their arguments."""

from collections import Counter

import numpy as np
import pytest

from services.league.sampling import SAMPLERS, Pool, Rule, Sampler, draw, probabilities, win_rates

chisquare = pytest.importorskip("scipy.stats").chisquare

HISTORY = tuple(f"sha256:{number:064x}" for number in range(12))
RESULTS = {
    HISTORY[0]: [2.0, 2.1, 1.9],
    HISTORY[3]: [-1.0, -1.2, -0.9, -1.1],
    HISTORY[5]: [0.5],
    HISTORY[7]: [0.1, 0.9],
}
POOL = Pool(HISTORY, RESULTS, anchors=("scripted:static",))
DRAWS = 4000


@pytest.mark.parametrize("sampler", SAMPLERS)
@pytest.mark.parametrize("seed", [0, 7])
def test_the_draws_match_the_distribution_of_their_sampler(sampler: Sampler, seed: int) -> None:
    rule = Rule(sampler, window=4, power=2.0, anchor_share=0.2)
    expected = probabilities(rule, POOL)
    assert expected.sum() == pytest.approx(1.0)
    counts = Counter(draw(rule, POOL, seed, index) for index in range(DRAWS))
    found = np.array([counts[ref] for ref in (*POOL.history, *POOL.anchors)])
    assert found.sum() == DRAWS
    possible = expected > 0
    assert not found[~possible].any()
    assert chisquare(found[possible], expected[possible] * DRAWS).pvalue > 1e-3


@pytest.mark.parametrize("sampler", SAMPLERS)
def test_the_same_arguments_draw_the_same_player(sampler: Sampler) -> None:
    rule = Rule(sampler, window=4)
    first = [draw(rule, POOL, 3, index) for index in range(50)]
    assert first == [draw(rule, POOL, 3, index) for index in range(50)]
    if sampler not in ("latest", "fixed"):
        assert first != [draw(rule, POOL, 4, index) for index in range(50)]


def test_each_sampler_gives_weight_to_those_it_is_for() -> None:
    pool = Pool(HISTORY, RESULTS)

    def support(rule: Rule) -> list[int]:
        return np.flatnonzero(probabilities(rule, pool)).tolist()

    assert support(Rule("latest")) == [11]
    assert support(Rule("fixed")) == [0]
    assert support(Rule("window", window=3)) == [9, 10, 11]
    assert support(Rule("uniform")) == list(range(12))
    assert probabilities(Rule("window", window=99), pool) == pytest.approx(np.full(12, 1 / 12))


def test_pfsp_weighs_by_the_share_of_lost_updates_to_the_power() -> None:
    pool = Pool(HISTORY[:3], {HISTORY[0]: [1.0, 1.0], HISTORY[1]: [-1.0, -1.0]})
    # The median is 0: two wins of two, none of two, none played; one win and one loss added.
    assert win_rates(pool) == pytest.approx([3 / 4, 1 / 4, 1 / 2])
    weights = np.array([1 / 16, 9 / 16, 4 / 16])
    assert probabilities(Rule("pfsp", power=2.0), pool) == pytest.approx(weights / weights.sum())


def test_anchors_share_their_part_and_never_leave() -> None:
    pool = Pool(HISTORY[:1], anchors=("scripted:static", "scripted:heuristic"))
    assert probabilities(Rule("latest", anchor_share=0.3), pool) == pytest.approx([0.7, 0.15, 0.15])


def test_a_pool_without_a_warm_start_is_refused() -> None:
    with pytest.raises(ValueError, match="no history"):
        probabilities(Rule(), Pool(()))
