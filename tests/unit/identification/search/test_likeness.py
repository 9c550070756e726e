"""Whether what was named only stands in for another law."""

import numpy as np
import pytest

from shared.identification.catalogue.gravity_tilt import EFFECT as GRAVITY_TILT
from shared.identification.catalogue.joint_spring import EFFECT as JOINT_SPRING
from shared.identification.catalogue.nonlinear_viscous import EFFECT as NONLINEAR
from shared.identification.catalogue.tool_offset import EFFECT as TOOL_OFFSET
from shared.identification.catalogue.torque_bias import EFFECT as BIAS
from shared.identification.catalogue.tracker_frame import EFFECT as TRACKER_FRAME
from shared.identification.effect import Candidate
from shared.identification.fitting.fit import polish
from shared.identification.fitting.space import Space
from shared.identification.search.likeness import why_only_like
from shared.identification.search.searched import Search
from shared.sim.plant.row import Row
from tests.measured import measure, plain, problem_of
from tests.searches import Searches

TILT = Candidate(GRAVITY_TILT, "")
TORQUE, DRAG = Candidate(BIAS, "elbow"), Candidate(NONLINEAR, "elbow")
SPRING = Candidate(JOINT_SPRING, "elbow")


def pull_and_brake(row: Row) -> None:
    TORQUE.effect.enter(row, TORQUE.place, np.array([2.0]))
    DRAG.effect.enter(row, DRAG.place, np.array([1.0]))


@pytest.fixture(scope="module")
def searches(tmp_path_factory: pytest.TempPathFactory) -> Searches:
    """Return searches where repeats say what noise is."""
    folder = tmp_path_factory.mktemp("data")
    made = Searches(folder, enter=pull_and_brake)
    rng = np.random.default_rng(0)
    made.problem = problem_of(measure(folder, rng, pull_and_brake, seconds=4.0))
    made.base = polish(Space(made.problem), made.fit(()).z, made.problem.of("train"))
    return made


def named(searches: Searches, *candidates: Candidate, is_event: bool = False) -> Search:
    """Return a search that took causes, which are fitted."""
    losses = np.ones(8)
    taken = [searches.tried(each, losses, losses, is_event=is_event) for each in candidates]
    found = searches.search(losses, taken[-1], before=tuple(taken[:-1]))
    space = Space(searches.problem, candidates)
    begun = np.r_[searches.base.z, np.full(space.size - space.base_size, 0.1)]
    found.candidates = (TORQUE, DRAG)
    found.current = polish(space, begun, searches.problem.of("train"))
    return found


def test_a_cause_that_leaves_what_another_would_explain_why_only_like_it(searches: Searches):
    assert why_only_like(named(searches, TORQUE))


def test_a_cause_is_the_law_where_no_other_explains_what_it_leaves(searches: Searches):
    found = named(searches, TORQUE, DRAG)
    found.candidates = (*found.candidates, SPRING)
    assert not why_only_like(found)


def test_of_causes_at_other_joints_nothing_is_asked(searches: Searches):
    found = named(searches, TORQUE)
    found.candidates = (TORQUE, Candidate(NONLINEAR, "lift"))
    assert not why_only_like(found)


def test_of_what_is_at_no_joint_nothing_is_asked(searches: Searches):
    found = named(searches, TILT)
    found.candidates = (TILT, Candidate(TOOL_OFFSET, ""), Candidate(TRACKER_FRAME, ""))
    assert not why_only_like(found)


def test_of_what_happened_once_nothing_is_asked(searches: Searches):
    assert not why_only_like(named(searches, TORQUE, is_event=True))


def test_nothing_is_asked_where_no_repeat_says_what_noise_is(searches: Searches):
    found = named(searches, TORQUE)
    assert found.problem.noise.is_white
    found.problem = plain(found.problem)
    assert not why_only_like(found)
