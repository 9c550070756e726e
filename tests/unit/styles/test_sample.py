import numpy as np
import pytest

from shared.errors import RiposteError
from shared.styles.sample import StyleSample, pooled_covariance
from tests.unit.styles.samples import NOISE, THREE_OF_SIX, TYPICAL, bouts


def test_means_and_spreads_are_those_of_each_policys_bouts():
    sample = bouts(THREE_OF_SIX, each=50)
    assert sample.policies == ("p0", "p1", "p2", "p3", "p4", "p5")
    assert sample.counts.tolist() == [300] * 6
    for k, centre in enumerate(THREE_OF_SIX):
        rows = [f for f, p in zip(sample.features, sample.policy, strict=True) if p == k]
        np.testing.assert_allclose(sample.means()[k], sum(rows) / len(rows))
        np.testing.assert_allclose(
            sample.means()[k], TYPICAL + NOISE * centre, atol=0.25 * NOISE.max()
        )
    np.testing.assert_allclose(sample.spreads(), np.tile(NOISE, (6, 1)), rtol=0.2)


def test_a_subset_holds_only_its_policies_in_the_order_asked_for():
    sample = bouts(THREE_OF_SIX)
    part = sample.subset(["p5", "p1"])
    assert part.policies == ("p5", "p1")
    np.testing.assert_array_equal(part.bouts_of(0), sample.bouts_of(5))
    np.testing.assert_array_equal(part.bouts_of(1), sample.bouts_of(1))
    assert len(part.opponent) == 240


def test_the_pooled_covariance_leaves_out_what_lies_between_policies():
    sample = bouts(THREE_OF_SIX, each=100, seed=3)
    pooled = pooled_covariance(sample.features / NOISE, sample.policy)
    np.testing.assert_allclose(pooled, np.eye(8), atol=0.1)


def test_what_cannot_be_is_refused_by_name():
    row = np.ones((1, 8))
    with pytest.raises(RiposteError, match="bouts of p0 in the table: 1"):
        StyleSample.of(["p0", "p1", "p1"], ["a", "a", "a"], np.repeat(row, 3, axis=0))
    bad = np.ones((4, 8))
    bad[2, 5] = np.nan
    with pytest.raises(RiposteError, match="bout 2 of p1 has mean_jerk nan"):
        StyleSample.of(["p0", "p0", "p1", "p1"], ["a"] * 4, bad)
    with pytest.raises(RiposteError, match=r"must be \[4, 8\]"):
        StyleSample.of(["p0"] * 4, ["a"] * 4, np.ones((4, 7)))
