"""Whether what was named only stands in for another law."""

from pathlib import Path

import numpy as np
import pytest

from shared.identification.catalogue.command_latency import EFFECT as LATE
from shared.identification.catalogue.encoder_scale import EFFECT as RATIO
from shared.identification.catalogue.gravity_tilt import EFFECT as GRAVITY_TILT
from shared.identification.catalogue.joint_spring import EFFECT as JOINT_SPRING
from shared.identification.catalogue.nonlinear_viscous import EFFECT as NONLINEAR
from shared.identification.catalogue.setpoint_speed import EFFECT as SLOW
from shared.identification.catalogue.tool_offset import EFFECT as TOOL_OFFSET
from shared.identification.catalogue.torque_bias import EFFECT as BIAS
from shared.identification.catalogue.tracker_frame import EFFECT as TRACKER_FRAME
from shared.identification.catalogue.tracker_latency import EFFECT as TRACKED_LATE
from shared.identification.effect import Candidate
from shared.identification.fitting.fit import polish
from shared.identification.fitting.space import Space
from shared.identification.search.likeness import why_only_like
from shared.identification.search.searched import Search
from shared.sim.plant.row import Row
from tests.measured import Enter, measure, plain, problem_of
from tests.searches import Searches

TILT = Candidate(GRAVITY_TILT, "")
TORQUE, DRAG = Candidate(BIAS, "elbow"), Candidate(NONLINEAR, "elbow")
SPRING = Candidate(JOINT_SPRING, "elbow")
READ, TOLD_LATE = Candidate(RATIO, "elbow"), Candidate(TRACKED_LATE, "")
SLOWED, SENT_LATE = Candidate(SLOW, ""), Candidate(LATE, "")


def pull_and_brake(row: Row) -> None:
    TORQUE.effect.enter(row, TORQUE.place, np.array([2.0]))
    DRAG.effect.enter(row, DRAG.place, np.array([1.0]))


def say_otherwise(row: Row) -> None:
    for candidate, size in ((READ, 0.03), (TOLD_LATE, 0.01), (SLOWED, 0.8), (SENT_LATE, 0.005)):
        candidate.effect.enter(row, candidate.place, np.array([size]))


def searches_of(folder: Path, enter: Enter) -> Searches:
    """Return searches where repeats say what noise is."""
    made = Searches(folder, enter=enter)
    rng = np.random.default_rng(0)
    made.problem = problem_of(measure(folder, rng, enter, seconds=4.0))
    made.base = polish(Space(made.problem), made.fit(()).z, made.problem.of("train"))
    return made


@pytest.fixture(scope="module")
def searches(tmp_path_factory: pytest.TempPathFactory) -> Searches:
    return searches_of(tmp_path_factory.mktemp("data"), pull_and_brake)


@pytest.fixture(scope="module")
def otherwise(tmp_path_factory: pytest.TempPathFactory) -> Searches:
    """Return searches of an arm that is told and read otherwise than it should be."""
    return searches_of(tmp_path_factory.mktemp("data"), say_otherwise)


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


@pytest.mark.parametrize(
    ("named_all", "missed"),
    [((READ, SENT_LATE, SLOWED), TOLD_LATE), ((READ, TOLD_LATE, SLOWED), SENT_LATE)],
    ids=["what is read", "what is told"],
)
def test_causes_that_leave_what_others_of_their_side_explain_are_only_like_it(
    otherwise: Searches, named_all: tuple[Candidate, ...], missed: Candidate
):
    found = named(otherwise, *named_all)
    found.candidates = (*named_all, missed)
    assert "of what is read or commanded" in why_only_like(found)


def test_what_is_told_and_read_is_the_law_where_no_other_of_its_side_is_left(otherwise: Searches):
    found = named(otherwise, READ, TOLD_LATE, SLOWED, SENT_LATE)
    found.candidates = (READ, TOLD_LATE, SLOWED, SENT_LATE, Candidate(TRACKER_FRAME, ""))
    assert not why_only_like(found)


def test_of_what_is_read_nothing_is_asked_beside_a_cause_of_the_plant(otherwise: Searches):
    found = named(otherwise, SPRING)
    found.candidates = (SPRING, TOLD_LATE)
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
