"""What is taken back of several causes."""

import numpy as np
import pytest

from shared.identification.dataset.types import Float64
from shared.identification.fewer import one_for_many
from shared.identification.searched import Search
from tests.searches import DRAG, ELBOW, LIFT, Searches


@pytest.fixture(scope="module")
def searches(tmp_path_factory: pytest.TempPathFactory) -> Searches:
    return Searches(tmp_path_factory.mktemp("data"))


def two_torques(searches: Searches, base: Float64, left: Float64) -> Search:
    """Return a search that took torques of two joints, and had tried a drag."""
    elbow, lift = (searches.tried(each, base, left) for each in (ELBOW, LIFT))
    drag = searches.tried(DRAG, np.full(8, 10.0), np.linspace(1.0, 1.2, 8))
    return searches.search(base, lift, before=(elbow,), tried=(drag,))


def test_one_cause_that_does_as_well_is_taken_for_two_of_one_effect(searches: Searches):
    found = two_torques(searches, np.linspace(8.0, 12.0, 4), np.linspace(0.95, 1.1, 4))
    one_for_many(found, found.problem.of("train"), found.problem.of("test"))
    assert [each.candidate for each in found.accepted] == [DRAG]
    assert found.current.space.candidates == (DRAG,)
    assert found.rivals == [()]
    assert found.current_losses.mean() < 1.3


def test_two_causes_of_one_effect_that_do_better_stay(searches: Searches):
    found = two_torques(searches, np.linspace(1.4, 1.6, 4), np.full(4, 0.01))
    one_for_many(found, found.problem.of("train"), found.problem.of("test"))
    assert [each.candidate for each in found.accepted] == [ELBOW, LIFT]
