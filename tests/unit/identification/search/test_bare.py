"""Friction that a model file is without is found at all joints before anything else is."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from shared.identification.fitting.fit import Fit
from shared.identification.fitting.problem import Problem
from shared.identification.fitting.space import Space
from shared.identification.search import bare
from shared.identification.search.bare import (
    lacking,
    loads_of,
    offsets_of,
    screened_of,
    with_drives,
)
from tests.arms import JOINTS, make_plant, make_subject
from tests.geared import FRICTION, candidates, problem_of_geared

DRIVES = ("coulomb_friction", "viscous_friction", "rotor_inertia")


def _base(problem: Problem) -> Fit:
    """Return the model file's, which is a base that was not fitted."""
    space = Space(problem)
    return Fit.at(space, np.zeros(space.size), problem.of("train"))


def test_joints_that_rub_are_named_and_viscous_friction_that_is_in_the_file_is_not(tmp_path: Path):
    problem = problem_of_geared(tmp_path)
    base = _base(problem)
    lacks = lacking(base.space, candidates(problem, *DRIVES))
    assert [each.label for each in lacks] == [f"coulomb_friction {joint}" for joint in JOINTS]
    found = with_drives(base, lacks, np.random.default_rng(0))
    assert found is not None
    assert set(found.gains) == set(lacks)
    assert found.losses.mean() < 0.01
    for each, values in zip(lacks, found.fit.space.values(found.fit.z), strict=True):
        assert values[0] == pytest.approx(FRICTION[each.place], rel=0.05)
        assert 0.5 < screened_of(found.fit, each).share <= 1.0


@pytest.mark.parametrize("load", [1.5, pytest.param(0.0, marks=pytest.mark.slow)])
def test_a_load_is_found_with_them_where_there_is_one(tmp_path: Path, load: float):
    problem = problem_of_geared(tmp_path, load)
    known = candidates(problem, "coulomb_friction", "payload")
    base = _base(problem)
    lacks = lacking(base.space, known)
    found = with_drives(base, lacks, np.random.default_rng(0), loads_of(known))
    assert found is not None
    space = found.fit.space
    carried = [each for each in found.gains if each.effect.name == "payload"]
    sizes = [space.values(found.fit.z)[space.candidates.index(each)][0] for each in carried]
    assert sizes == ([pytest.approx(load, rel=0.05)] if load else [])


def test_a_joint_that_something_pushes_shows_what_others_have_beside_that(tmp_path: Path):
    problem = problem_of_geared(tmp_path, is_bare=True, push=5.0)
    problem = replace(problem, noise=replace(problem.noise, joints=np.full(len(JOINTS), 1e-3)))
    known = candidates(problem, *DRIVES, "torque_bias")
    base = _base(problem)
    lacks = lacking(base.space, known)
    assert not {each.effect.name for each in lacks} - set(DRIVES)
    alone = with_drives(base, lacks, np.random.default_rng(0))
    found = with_drives(base, lacks, np.random.default_rng(0), offsets=offsets_of(known))
    assert found is not None
    (pushed,) = (each for each in found.gains if each.effect.name == "torque_bias")
    assert pushed.place == JOINTS[0]
    space = found.fit.space
    (size,) = space.values(found.fit.z)[space.candidates.index(pushed)]
    assert size == pytest.approx(5.0, rel=0.05)
    assert alone is None or alone.losses.mean() > 100.0 * found.losses.mean()
    assert set(lacks) < set(found.gains)


def test_a_load_of_an_arm_that_does_not_rub_is_left_to_the_search(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    for joint in JOINTS:
        monkeypatch.setitem(FRICTION, joint, 0.0)
    problem = problem_of_geared(tmp_path, 1.5)
    known = candidates(problem, "coulomb_friction", "payload")
    base = _base(problem)
    lacks = lacking(base.space, known)
    assert with_drives(base, lacks, np.random.default_rng(0), loads_of(known)) is None


def test_nothing_is_lacking_where_the_file_has_it_or_a_servo_holds_the_arm(tmp_path: Path):
    problem = problem_of_geared(tmp_path)
    one = candidates(problem, "coulomb_friction")[:1]
    assert lacking(Space(problem), one) == ()
    assert lacking(Space(problem), candidates(problem, "payload")) == ()
    servo = replace(problem, subject=make_subject(make_plant(tmp_path)))
    assert lacking(Space(servo), candidates(problem, *DRIVES)) == ()
    assert with_drives(_base(problem), (), np.random.default_rng(0)) is None


def test_kinds_without_which_all_is_left_come_back(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    problem = problem_of_geared(tmp_path, is_bare=True)
    base = _base(problem)
    lacks = lacking(base.space, candidates(problem, *DRIVES))
    viscous = tuple(each for each in lacks if each.effect.name == "viscous_friction")
    monkeypatch.setattr(bare, "_needed", lambda *_: viscous)  # as of motion that tells little
    found = with_drives(base, lacks, np.random.default_rng(0))
    assert found is not None
    assert {each.effect.name for each in found.gains} == set(DRIVES)
    sizes = dict(zip(found.fit.space.candidates, found.fit.space.values(found.fit.z), strict=True))
    rubs = {each.place: sizes[each][0] for each in lacks if each.effect.name == "coulomb_friction"}
    assert rubs == pytest.approx(FRICTION, rel=0.1)
