import numpy as np
import pytest

from shared.errors import RiposteError
from shared.styles.diversity import diversity, vendi_score, yardstick
from tests.unit.styles.samples import NOISE, THREE_OF_SIX, apart, bouts


def measure(sample, seed: int = 0, scale=None):
    return diversity(sample, np.random.default_rng(seed), scale)


def test_the_effective_number_of_things_that_have_nothing_in_common_is_their_number():
    assert vendi_score(np.eye(5)) == pytest.approx(5.0)
    assert vendi_score(np.ones((5, 5))) == pytest.approx(1.0)
    two_kinds = np.kron(np.eye(2), np.ones((3, 3)))
    assert vendi_score(two_kinds) == pytest.approx(2.0)


def test_policies_in_two_camps_are_two_styles():
    camps = [apart(*((k, 20.0) for k in range(8)))] * 3 + [apart()] * 3
    found = measure(bouts(camps, each=200))
    assert found.policies == 6
    assert found.effective_styles.value == pytest.approx(2.0, abs=0.02)
    # 9 of 15 pairs lie 20 yardsticks apart, the others together.
    assert found.distance.value == pytest.approx(12.0, abs=0.1 * 12)


def test_copies_of_one_policy_are_one_style():
    found = measure(bouts([apart()] * 6, each=100))
    assert found.effective_styles.value == pytest.approx(1.0, abs=0.02)
    assert found.distance.value < 0.1


def test_policies_all_far_from_each_other_count_one_by_one():
    generator = np.random.default_rng(1)
    found = measure(bouts(40.0 * generator.normal(size=(6, 8))))
    assert found.effective_styles.value > 5.99
    assert found.effective_styles.high <= 6.0


def test_the_yardstick_is_the_spread_within_policies():
    np.testing.assert_allclose(yardstick(bouts(THREE_OF_SIX, each=100)), NOISE, rtol=0.05)


def test_a_feature_that_never_varies_within_a_policy_has_a_yardstick_too():
    sample = bouts(THREE_OF_SIX)
    sample.features[:, 2] = 5.0
    sample.features[:, 3] = sample.policy
    found = yardstick(sample)
    assert found[2] == 1.0
    assert found[3] == pytest.approx(np.std(np.arange(6.0)))
    assert np.isfinite(measure(sample).distance.value)


def test_two_libraries_are_compared_by_one_yardstick():
    calm = bouts([apart(), apart((0, 6.0)), apart((4, 6.0))])
    erratic = bouts([apart(), apart((0, 6.0)), apart((4, 6.0))])
    centres = erratic.means()[erratic.policy]
    erratic.features[:] = centres + 3.0 * (erratic.features - centres)
    assert measure(erratic).distance.value < 0.5 * measure(calm).distance.value
    common = yardstick(calm)
    assert measure(erratic, scale=common).distance.value == pytest.approx(
        measure(calm, scale=common).distance.value
    )


def test_the_interval_covers_the_truth_as_often_as_it_says():
    centres = [apart(), apart((0, 3.0)), apart((4, 3.0))]
    gaps = [np.sqrt(9 / 8), np.sqrt(9 / 8), np.sqrt(18 / 8)]
    hits = 0
    for seed in range(60):
        found = measure(bouts(centres, each=10, seed=seed), seed, scale=NOISE)
        assert found.distance.low <= found.distance.high
        hits += found.distance.low <= np.mean(gaps) <= found.distance.high
    assert 51 <= hits <= 60  # 95 % of 60 is 57


def test_one_policy_has_no_diversity():
    with pytest.raises(RiposteError, match="at least 2 policies, there is 1"):
        measure(bouts([apart()]))
