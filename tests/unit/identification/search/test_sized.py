"""What may as well be nothing is not named, however well held-out motion follows it."""

from pathlib import Path

import numpy as np
import pytest

from shared.identification.catalogue.gravity_tilt import EFFECT as TILT
from shared.identification.effect import Candidate
from shared.identification.fitting.fit import polish
from shared.identification.search.searched import Search
from shared.identification.search.sized import take_back_sizeless, widths_of
from shared.sim.plant.row import Row
from tests.measured import Enter, nothing
from tests.searches import ELBOW, LIFT, Searches

_BASE, _LEFT = np.full(4, 9.0), np.linspace(1.0, 1.2, 4)
_BESIDE = Candidate(TILT, "")


def _pull(row: Row) -> None:
    ELBOW.effect.enter(row, ELBOW.place, np.array([1.0]))


def _taken(folder: Path, enter: Enter, candidate: Candidate, *rivals: Candidate) -> Search:
    """Return a search that took a cause, with what held-out recordings say of it made up."""
    searches = Searches(folder, enter=enter)
    one, *others = (searches.tried(each, _BASE, _LEFT) for each in (candidate, *rivals))
    found = searches.search(_BASE, one, tuple(others))
    train = found.problem.of("train")
    found.current = polish(found.current.space, found.current.z, train, 4)
    return found


def test_a_cause_that_may_as_well_be_nothing_is_taken_back(tmp_path: Path):
    found = _taken(tmp_path, nothing, ELBOW)
    take_back_sizeless(found, ())
    assert found.accepted == found.rivals == []
    assert found.current is found.base
    assert found.final is None


def test_a_cause_of_a_sure_size_is_kept(tmp_path: Path):
    found = _taken(tmp_path, _pull, ELBOW)
    own = found.current.space.where(ELBOW)
    assert np.all(np.abs(found.current.z[own]) > widths_of(found)[own])
    take_back_sizeless(found, ())
    assert [one.candidate for one in found.accepted] == [ELBOW]


@pytest.mark.parametrize(("candidate", "rivals"), [(_BESIDE, ()), (ELBOW, (LIFT,))])
def test_neither_one_of_two_angles_nor_what_is_in_a_tie_has_to_be_sure_by_itself(
    tmp_path: Path, candidate: Candidate, rivals: tuple[Candidate, ...]
):
    found = _taken(tmp_path, nothing, candidate, *rivals)
    take_back_sizeless(found, ())
    assert [one.candidate for one in found.accepted] == [candidate]
