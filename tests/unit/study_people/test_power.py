import numpy as np
import pytest

from shared.errors import StudyError
from shared.study.analysis.power import components_of, found, plan

GAMES = np.arange(1.0, 11.0)


def played(people: int, slopes: tuple[float, float], spread: float, noise: float, seed: int):
    """Return scores of a study with known components, float64[people, 10] for each condition."""
    rng = np.random.default_rng(seed)
    first, second = (
        100.0
        + (slope + spread * rng.standard_normal((people, 1)) / np.sqrt(2.0)) * GAMES
        + noise * rng.standard_normal((people, 10))
        for slope in slopes
    )
    return first, second


def test_planted_components_are_found_again():
    components = components_of(GAMES, *played(4000, (30.0, 15.0), 20.0, 100.0, seed=1))
    assert components.residuals.std() == pytest.approx(100.0, rel=0.02)
    assert components.slope_spread == pytest.approx(20.0, rel=0.06)


def test_without_an_effect_five_percent_of_studies_find_one():
    components = components_of(GAMES, *played(200, (10.0, 10.0), 15.0, 80.0, seed=2))
    count = found(components, 0.0, 10, 4000, np.random.default_rng(3))
    assert 0.040 < count / 4000 < 0.060  # 3 standard errors


def test_the_power_is_that_of_the_noncentral_t():
    components = components_of(GAMES, *played(400, (10.0, 10.0), 15.0, 80.0, seed=4))
    # a standardised difference of 1 with 10 people: 0.803 (Cohen 1988; R: power.t.test, paired)
    count = found(components, components.spread, 10, 4000, np.random.default_rng(5))
    assert count / 4000 == pytest.approx(0.803, abs=0.02)


def test_a_plan_says_how_many_people_and_how_sure_that_is():
    first, second = played(10, (30.0, 15.7), 5.0, 120.0, seed=6)
    planned = plan(GAMES, first, second, 14.3, range(4, 61, 2), 500, np.random.default_rng(7))
    assert planned.needed is not None
    assert planned.needed_low is not None
    assert planned.needed_low <= planned.needed
    assert planned.needed_high is None or planned.needed_high >= planned.needed
    powers = [each.power.value for each in planned.curve]
    assert powers[-1] > powers[0]


def test_an_effect_out_of_reach_needs_more_people_than_were_tried():
    first, second = played(10, (30.0, 15.7), 5.0, 120.0, seed=8)
    planned = plan(GAMES, first, second, 0.01, (4, 8), 200, np.random.default_rng(9))
    assert (planned.needed, planned.needed_high) == (None, None)


def test_two_people_are_too_few_to_say_how_people_differ():
    first, second = played(2, (30.0, 15.7), 5.0, 120.0, seed=8)
    with pytest.raises(StudyError, match="2 people with 10 games"):
        components_of(GAMES, first, second)
