import itertools

import numpy as np
import pytest

from shared.errors import RiposteError
from shared.styles.components import fit_components
from shared.styles.selection import distances_between, select
from tests.unit.styles.samples import NOISE, THREE_OF_SIX, TYPICAL, apart, bouts


@pytest.mark.parametrize("seed", range(8))
def test_the_three_that_were_planted_far_apart_are_selected(seed: int):
    sample = bouts(THREE_OF_SIX, seed=seed)
    found = select(sample, fit_components(sample))
    assert found.chosen.policies == ("p1", "p3", "p5")
    assert len(found.triples) == 20
    assert found.chosen.smallest > 5.0
    assert found.triples[1].smallest < found.chosen.smallest


def test_distances_are_mahalanobis_by_the_textbook():
    sample = bouts(THREE_OF_SIX, opponent_effect=1.0)
    components = fit_components(sample)
    scores = components.project(sample.features)
    groups = [scores[sample.policy == k] for k in range(6)]
    within = sum(np.cov(g.T) * (len(g) - 1) for g in groups) / (len(scores) - 6)
    found = distances_between(sample, components)
    for i, j in itertools.combinations(range(6), 2):
        gap = groups[i].mean(0) - groups[j].mean(0)
        expected = np.sqrt(gap @ np.linalg.inv(within) @ gap)
        assert found[i, j] == found[j, i] == pytest.approx(expected, rel=1e-6)


def test_the_criterion_is_the_smallest_distance_not_the_mean():
    # p0 and p1 are near each other and p2 very far: a large mean, a small minimum.
    centres = [apart(), apart((0, 1.0)), apart((0, 60.0)), apart((0, 12.0), (4, 9.0))]
    sample = bouts(centres, each=50)
    found = select(sample, fit_components(sample))
    by_name = {triple.policies: triple for triple in found.triples}
    near, chosen = by_name["p0", "p1", "p2"], found.chosen
    assert "p3" in chosen.policies
    assert "p2" in chosen.policies
    assert near.mean > 20.0
    assert chosen.smallest > near.smallest
    for triple in found.triples:
        i, j, k = (found.policies.index(name) for name in triple.policies)
        sides = [found.distances[i, j], found.distances[i, k], found.distances[j, k]]
        assert triple.smallest == pytest.approx(min(sides))
        assert triple.mean == pytest.approx(sum(sides) / 3)


def test_a_tie_goes_to_the_order_of_names():
    # p0 and p3 are the very same bouts under two names, so triples with one or the other tie.
    sample = bouts([apart(), apart((0, 9.0)), apart((4, 9.0)), apart()])
    sample.features[sample.policy == 3] = sample.features[sample.policy == 0]
    found = select(sample, fit_components(sample))
    assert found.chosen.policies == ("p0", "p1", "p2")
    assert found.triples[1].policies == ("p1", "p2", "p3")
    assert found.triples[1].smallest == pytest.approx(found.chosen.smallest)


def test_policies_that_never_vary_are_still_compared():
    sample = bouts(THREE_OF_SIX)
    sample.features[:] = TYPICAL + NOISE * np.array(THREE_OF_SIX)[sample.policy]
    found = select(sample, fit_components(sample))
    assert found.chosen.policies == ("p1", "p3", "p5")
    assert np.isfinite(found.distances).all()


def test_the_order_of_bouts_does_not_matter():
    sample = bouts(THREE_OF_SIX)
    order = np.random.default_rng(2).permutation(len(sample.policy))
    names = [sample.policies[k] for k in sample.policy[order]]
    others = [sample.opponents[k] for k in sample.opponent[order]]
    mixed = type(sample).of(names, others, sample.features[order])
    one = select(sample, fit_components(sample)).chosen
    other = select(mixed, fit_components(mixed)).chosen
    assert set(one.policies) == set(other.policies)
    assert one.smallest == pytest.approx(other.smallest)


def test_two_policies_are_too_few():
    sample = bouts([apart(), apart((0, 5.0))])
    with pytest.raises(RiposteError, match="needs at least 3, this run has 2; train it with"):
        select(sample, fit_components(sample))
