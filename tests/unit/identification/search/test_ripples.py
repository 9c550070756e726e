"""A ripple stands out of what a base fit leaves, at its joint and with its number."""

import math
from pathlib import Path

import numpy as np
import pytest

from shared.identification.catalogue.cogging import EFFECT as COGGING
from shared.identification.catalogue.joint_spring import EFFECT as SPRING
from shared.identification.effect import Candidate
from shared.identification.fitting.fit import Fit, polish
from shared.identification.fitting.space import Space
from shared.identification.search.looks import looks_of
from shared.identification.search.ripples import ripples_left
from shared.sim.plant.row import Row
from tests.arms import JOINTS
from tests.measured import Enter, measure, nothing, problem_of

CANDIDATES = [Candidate(COGGING, joint) for joint in JOINTS]


def fitted(folder: Path, enter: Enter) -> tuple[Fit, tuple[int, ...]]:
    problem = problem_of(measure(folder, np.random.default_rng(0), enter, seconds=6.0))
    space, segments = Space(problem), problem.of("train")
    return polish(space, np.zeros(space.size), segments, 2), segments


@pytest.mark.parametrize(("place", "size", "ripples"), [("pan", 0.02, 30.0), ("elbow", 0.03, 37.0)])
def test_a_small_ripple_is_seen_where_it_is(
    tmp_path: Path, place: str, size: float, ripples: float
) -> None:
    def enter(row: Row) -> None:
        COGGING.enter(row, place, np.array([size, -size, ripples]))

    fit, segments = fitted(tmp_path, enter)
    found = ripples_left(fit, CANDIDATES, segments)
    (candidate,) = (each for each in found if each.place == place)  # and at what hangs on it
    subject = fit.space.problem.subject
    travel = float(subject.travel[subject.joints.index(place)])
    nearest = min(found[candidate], key=lambda each: abs(each - ripples))
    assert abs(nearest - ripples) * travel / 2.0 < math.pi / 2.0

    looks, fewer = (looks_of(subject, [candidate], more)[candidate] for more in (found, None))
    tried = {float(each.form[2]) for each in looks} - {float(each.form[2]) for each in fewer}
    probe = COGGING.quantities(subject, place)[2].probe
    assert sorted(probe * each for each in tried) == pytest.approx(sorted(found[candidate]))


def test_nothing_stands_out_of_noise_nor_of_what_has_no_ripples(tmp_path: Path) -> None:
    fit, segments = fitted(tmp_path, nothing)
    assert ripples_left(fit, CANDIDATES, segments) == {}
    assert ripples_left(fit, [Candidate(SPRING, "elbow")], segments) == {}
