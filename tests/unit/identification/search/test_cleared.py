"""Links that were held are let go once causes are named, and doubted no more if they stay."""

from pathlib import Path

import numpy as np
import pytest

from shared.identification.catalogue.torque_bias import EFFECT as BIAS
from shared.identification.progress import silent
from shared.identification.search.cleared import clear
from shared.identification.search.searched import Search, is_open
from shared.sim.plant.row import Row
from tests.measured import Enter, nothing
from tests.searches import ELBOW, LIFT, Searches

_HELD = "mass elbow"
_BASE, _LEFT = np.full(4, 200.0), np.full(4, 15.0)


def _heavier(row: Row) -> None:
    body = row.body_of("elbow")
    row.field("body_mass")[body] *= 4.0
    row.field("body_inertia").reshape(-1, 3)[body] *= 4.0


def _held(folder: Path, enter: Enter) -> Searches:
    """Return searches of an arm whose base lacks one number."""
    searches = Searches(folder, enter=enter)
    names = [each.name for each in searches.problem.parameters]
    searches.problem = searches.problem.without([names.index(_HELD)])
    searches.base = searches.fit(())
    return searches


def _doubted(folder: Path, enter: Enter) -> Search:
    """Return a search of such an arm, with a cause that leaves much."""
    searches = _held(folder, enter)
    found = searches.search(_BASE, searches.tried(ELBOW, _BASE, _LEFT), doubted=(_HELD,))
    assert is_open(found)
    return found


@pytest.mark.parametrize(("enter", "doubted"), [(nothing, ()), (_heavier, (_HELD,))])
def test_a_link_that_is_let_go_says_whether_it_is_to_be_doubted(
    tmp_path: Path, enter: Enter, doubted: tuple[str, ...]
):
    found = _doubted(tmp_path, enter)
    clear(found, silent)
    assert found.doubted == doubted
    assert is_open(found) == bool(doubted)


def test_a_cause_is_told_beside_the_links_that_are_let_go(tmp_path: Path):
    found = _doubted(tmp_path, nothing)
    base, where = found.base, found.current.space.where(ELBOW)
    clear(found, silent)
    assert [each.name for each in found.problem.parameters][-1] == _HELD
    for fit in (found.base, found.current):
        assert fit.space.problem is found.problem
        assert fit.jacobian.shape == (len(fit.residual), fit.space.size)
    assert found.base.z.tolist() == [*base.z, 0.0]
    assert found.current.space.where(ELBOW).start == where.start + 1
    assert found.current.z[where.start] != 0.0


def _pulled(row: Row) -> None:
    BIAS.enter(row, "elbow", np.array([0.3]))


def test_a_cause_that_is_nothing_beside_the_links_that_are_let_go_is_taken_back(tmp_path: Path):
    searches = _held(tmp_path, _pulled)
    before = searches.tried(LIFT, _BASE, np.full(4, 100.0))
    taken = searches.tried(ELBOW, _BASE, _LEFT)
    found = searches.search(_BASE, taken, doubted=(_HELD,), before=(before,))
    clear(found, silent)
    assert [each.candidate for each in found.accepted] == [ELBOW]
    assert found.current.space.candidates == (ELBOW,)
    assert len(found.rivals) == 1


def test_what_is_left_of_an_arm_without_doubts_may_be_too_much_as_well(tmp_path: Path):
    found = _doubted(tmp_path, nothing)
    found.current_losses = np.full(4, 0.2 * 200.0)
    clear(found, silent)
    assert found.doubted == (_HELD,)
