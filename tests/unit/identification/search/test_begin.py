"""What a base may not bend any more is looked for like any other cause."""

from dataclasses import replace

import numpy as np
import pytest

from shared.identification.fitting.fit import Start
from shared.identification.search.begin import begin_without, doubted_of
from tests.searches import ELBOW, Searches

_BAD = np.full(8, 3.0)


@pytest.fixture(scope="module")
def searches(tmp_path_factory: pytest.TempPathFactory) -> Searches:
    return Searches(tmp_path_factory.mktemp("data"))


def test_links_further_off_than_what_is_known_of_them_are_doubted_beside_causes_too(
    searches: Searches,
):
    names = [each.name for each in searches.problem.parameters]
    fit = searches.tried(ELBOW, _BAD, _BAD / 3.0).fit
    z = fit.z.copy()
    z[names.index("mass lift")], z[names.index("mass pan")] = 0.31, -0.29
    z[names.index("damping pan")] = 2.0  # may be anything
    assert [names[index] for index in doubted_of(replace(fit, z=z))] == ["mass lift"]


def test_a_search_begins_again_without_what_its_base_may_not_bend(searches: Searches):
    found = searches.search(_BAD, doubted=("mass pan",))
    train, origin = found.problem.of("train"), np.zeros(found.base.space.size)
    found.nominal = Start(origin, found.base.space.jacobian(origin, train)[1])
    names = [each.name for each in found.problem.parameters]
    gone = [names.index("mass lift"), names.index("mass elbow")]
    again = begin_without(found, gone, seed=3)
    left = [each.name for each in again.problem.parameters]
    assert left == [name for name in names if name not in ("mass lift", "mass elbow")]
    assert again.doubted == ("mass pan", "mass lift", "mass elbow")
    assert again.base.space.size == again.parts.space.size == len(left)
    assert again.candidates == found.candidates
    assert not again.accepted
    assert [each.name for each in found.problem.parameters] == names


def test_a_search_may_begin_with_a_base_that_bends_in_nothing(searches: Searches):
    found = searches.search(_BAD)
    train, origin = found.problem.of("train"), np.zeros(found.base.space.size)
    found.nominal = Start(origin, found.base.space.jacobian(origin, train)[1])
    again = begin_without(found, range(found.base.space.size), seed=3)
    assert again.problem.parameters == ()
    assert again.base.z.shape == again.parts.z.shape == (0,)
    assert again.base.jacobian.shape == (len(again.base.residual), 0)
    assert again.base.cost == pytest.approx(found.base.cost)  # which bends in nothing either


def test_nothing_is_doubted_of_a_base_as_the_file_has_it(searches: Searches):
    assert doubted_of(searches.base) == []
