import numpy as np
import pytest

from shared.errors import RiposteError
from shared.styles.components import fit_components
from tests.unit.styles.samples import NOISE, THREE_OF_SIX, TYPICAL, apart, bouts


def literal_shares(rows, scale):
    """Eigenvalues of the covariance of rows in units of ``scale``, the textbook way."""
    standard = (rows - rows.mean(axis=0)) / scale
    values = np.sort(np.linalg.eigvalsh(standard.T @ standard))[::-1]
    return values / values.sum()


def test_shares_are_the_eigenvalues_of_the_covariance_of_standardised_styles():
    sample = bouts(THREE_OF_SIX)
    found = fit_components(sample)
    scale = sample.features.std(axis=0)
    np.testing.assert_allclose(found.shares, literal_shares(sample.means(), scale)[:6], atol=1e-12)
    np.testing.assert_allclose(found.bout_shares, literal_shares(sample.features, scale))
    assert found.information(8) == pytest.approx(1.0)
    np.testing.assert_allclose(found.axes @ found.axes.T, np.eye(len(found.axes)), atol=1e-12)


def test_features_in_which_policies_do_not_differ_take_no_part():
    sample = bouts(THREE_OF_SIX, each=100)  # they differ in 0, 4 and 5
    found = fit_components(sample)
    weights = (found.axes[:3] ** 2).sum(axis=0)
    assert (weights[[0, 4, 5]] > 0.98).all()
    assert found.information() > 0.99


def test_projecting_keeps_distances_between_styles_when_nothing_is_lost():
    sample = bouts(THREE_OF_SIX[:4])
    found = fit_components(sample)
    assert found.information(3) == pytest.approx(1.0)  # four points lie in three dimensions
    assert found.why_not() == ""
    standard = sample.means() / sample.features.std(axis=0)
    projected = found.project(sample.means())
    for i in range(4):
        for j in range(4):
            assert np.linalg.norm(projected[i] - projected[j]) == pytest.approx(
                np.linalg.norm(standard[i] - standard[j])
            )


def test_styles_planted_in_three_dimensions_are_found_to_lose_next_to_nothing():
    generator = np.random.default_rng(11)
    directions = generator.normal(size=(3, 8))
    centres = 40.0 * generator.normal(size=(6, 3)) @ directions
    found = fit_components(bouts(centres, each=100))
    assert found.information() > 0.999
    assert found.needed() <= 3
    assert found.why_not() == ""


def test_styles_that_differ_in_more_than_three_ways_say_which():
    # Six policies, each alone in one feature: five dimensions, all alike.
    centres = [apart((k, 30.0)) for k in range(5)] + [apart()]
    found = fit_components(bouts(centres, each=200))
    assert found.information() < 0.98
    assert found.needed() in (4, 5)
    text = found.why_not()
    assert "more than three independent ways" in text
    assert f"{1 - found.information():.1%}" in text
    assert f"{found.needed()} components keep 98%" in text


def test_a_policy_outside_the_fit_is_projected_by_the_same_map():
    sample = bouts(THREE_OF_SIX)
    found = fit_components(sample)
    np.testing.assert_allclose(found.project(sample.means()).mean(axis=0), 0.0, atol=1e-9)
    direction = found.scale * found.axes[1]
    np.testing.assert_allclose(
        found.project(found.centre + 2.5 * direction), [0, 2.5, 0], atol=1e-9
    )


def test_a_feature_that_is_the_same_for_all_does_no_harm():
    sample = bouts(THREE_OF_SIX)
    sample.features[:, 7] = -14.0
    found = fit_components(sample)
    assert np.isfinite(found.project(sample.features)).all()
    np.testing.assert_allclose(found.axes[:3, 7], 0.0, atol=1e-9)


def test_one_policy_or_six_copies_of_it_have_no_components():
    with pytest.raises(RiposteError, match="at least 2 policies to compare, there is 1"):
        fit_components(bouts([apart()]))
    sample = bouts([apart()] * 3)
    sample.features[:] = TYPICAL + np.tile(NOISE, (len(sample.features), 1))
    with pytest.raises(RiposteError, match="all 3 policies are the same"):
        fit_components(sample)
