import math

import numpy as np
import pytest

from shared.errors import RiposteError
from shared.styles.separability import separability, wilson
from tests.unit.styles.samples import THREE_OF_SIX, apart, bouts


def measure(sample, seed: int = 0):
    return separability(sample, np.random.default_rng(seed))


def test_far_apart_policies_are_told_apart_on_both_kinds_of_folds():
    found = measure(bouts(THREE_OF_SIX).subset(["p1", "p3", "p5"]))
    assert found.bouts == 360
    assert found.chance == pytest.approx(1 / 3)
    assert found.random_folds.share > 0.99
    assert found.by_opponent is not None
    assert found.by_opponent.share > 0.99
    assert found.by_opponent.folds == 6


def test_policies_that_are_one_are_told_apart_no_better_than_by_chance():
    found = measure(bouts([apart()] * 3, each=100))
    assert abs(found.random_folds.share - found.chance) < 0.05
    assert found.random_folds.low < 1 / 3 + 0.01


@pytest.mark.parametrize("distance", [1.0, 2.0])
def test_two_policies_in_one_feature_have_the_accuracy_of_theory(distance: float):
    """Bayes' accuracy of two Gaussians d standard deviations apart is Phi(d / 2)."""
    found = measure(bouts([apart(), apart((3, distance))], each=400))
    bayes = 0.5 * (1 + math.erf(distance / 2 / math.sqrt(2)))
    assert found.random_folds.share == pytest.approx(bayes, abs=0.02)
    assert found.random_folds.low < bayes < found.random_folds.high + 0.01


def test_what_an_opponent_does_to_style_makes_new_opponents_harder():
    """Policies whose order in a feature turns round with the opponent: known ones are no help."""
    generator = np.random.default_rng(4)
    sample = bouts([apart(), apart()], each=40)
    signs = np.where(generator.permutation(6) % 2, 1.0, -1.0)
    shift = np.where(sample.policy == 0, 1.0, -1.0) * signs[sample.opponent]
    sample.features[:, 3] += 0.1 * shift  # 4 standard deviations
    sample.features[:, 0] += 3.0 * sample.opponent  # tells the opponents apart
    found = measure(sample)
    assert found.by_opponent is not None
    assert found.by_opponent.share < found.random_folds.share
    assert found.by_opponent.low <= found.by_opponent.share <= found.by_opponent.high


def test_the_confusion_counts_every_bout_once():
    found = measure(bouts([apart(), apart((0, 1.0)), apart((0, 9.0))], each=30))
    for accuracy in (found.random_folds, found.by_opponent):
        assert accuracy is not None
        assert accuracy.confusion.sum(axis=1).tolist() == [180, 180, 180]
        assert np.trace(accuracy.confusion) / 540 == pytest.approx(accuracy.share)
        assert accuracy.confusion[0, 1] + accuracy.confusion[1, 0] > 0  # the near ones
        assert accuracy.confusion[0, 2] + accuracy.confusion[2, 0] == 0  # the far ones


def test_the_same_seed_gives_the_same_numbers():
    sample = bouts([apart(), apart((0, 1.0))])
    one, other = measure(sample, 3), measure(sample, 3)
    assert one.random_folds.share == other.random_folds.share
    np.testing.assert_array_equal(one.random_folds.confusion, other.random_folds.confusion)


def test_with_one_opponent_there_is_no_accuracy_on_new_ones():
    assert measure(bouts([apart(), apart((0, 3.0))], opponents=1)).by_opponent is None


def test_one_policy_cannot_be_told_from_anything():
    with pytest.raises(RiposteError, match="takes two, there is 1"):
        measure(bouts([apart()]))


def test_wilsons_interval_is_that_of_the_textbook():
    low, high = wilson(81, 263)  # Newcombe 1998, table I
    assert (low, high) == (pytest.approx(0.2553, abs=1e-4), pytest.approx(0.3662, abs=1e-4))
    assert wilson(10, 10)[1] == pytest.approx(1.0)
    assert wilson(0, 10)[0] == pytest.approx(0.0)
