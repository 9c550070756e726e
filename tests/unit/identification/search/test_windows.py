"""The window of what happened once."""

import numpy as np
import pytest

from shared.identification.catalogue.external_contact import EFFECT as PUSH
from shared.identification.effect import Candidate
from shared.identification.fitting.fit import Fit, polish
from shared.identification.fitting.space import Space
from shared.identification.search.screen import screen
from shared.identification.search.windows import closer, within
from shared.sim.plant.row import Row
from tests.measured import measure, problem_of

SHORT = (2.0, 2.63, 0.12)
"""Torque (N m), begin and length (s): of two windows of half a second it is in a quarter."""
ELBOW = Candidate(PUSH, "elbow in first")


@pytest.fixture(scope="module")
def pushed(tmp_path_factory: pytest.TempPathFactory) -> Fit:
    """Return a base fitted to recordings in one of which something pushed."""

    def enter(row: Row) -> None:
        PUSH.enter(row, ELBOW.place, np.array(SHORT))

    folder = tmp_path_factory.mktemp("data")
    problem = problem_of(measure(folder, np.random.default_rng(0), enter, seconds=4.0))
    space = Space(problem)
    return polish(space, np.zeros(space.size), problem.of("train"), 2)


def sizes(fit: Fit, start: np.ndarray) -> list[float]:
    problem = fit.space.problem
    found = PUSH.quantities(problem.subject, ELBOW.place)
    return [float(each.probe * value) for each, value in zip(found, start, strict=True)]


def test_a_push_much_shorter_than_the_windows_first_tried_is_found_in_its_own(pushed: Fit):
    segments = pushed.space.problem.of("train")
    first = next(each for each in screen(pushed, [ELBOW], segments) if each.candidate == ELBOW)
    found = closer(pushed, first, segments)
    assert sizes(pushed, first.start)[0] < 0.5 * SHORT[0]
    assert sizes(pushed, found.start) == pytest.approx(list(SHORT), rel=0.3, abs=0.05)
    assert found.share > 1.3 * first.share
    assert found.signature.shape == first.signature.shape


@pytest.mark.parametrize("seen", [(2.5, 3.0), (2.4, 2.7), (2.6, 2.64)])
def test_where_a_push_was_about_seen_it_is_found(pushed: Fit, seen: tuple[float, float]):
    found = within(pushed, ELBOW, *seen, pushed.space.problem.of("train"))
    torque, begin, length = sizes(pushed, found.start)
    assert torque * length == pytest.approx(SHORT[0] * SHORT[2], rel=0.25)
    assert begin + 0.5 * length == pytest.approx(SHORT[1] + 0.5 * SHORT[2], abs=0.03)


def test_a_window_never_leaves_the_recording(pushed: Fit):
    found = within(pushed, ELBOW, 3.8, 4.2, pushed.space.problem.of("train"))
    _, begin, length = sizes(pushed, found.start)
    until = PUSH.quantities(pushed.space.problem.subject, ELBOW.place)[1].high
    assert 0.0 <= begin <= begin + length <= until + 1e-9
