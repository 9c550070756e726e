"""Fits find what was planted."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from shared.identification.arm.subject import recorded_of, subject_of
from shared.identification.dataset.types import Dataset, Float64, ModelSource, Trajectory
from shared.identification.fitting.base import (
    WINDOW,
    BaseFits,
    _from_elsewhere,  # pyright: ignore[reportPrivateUsage]
    _usual_power,  # pyright: ignore[reportPrivateUsage]
    fit_base,
    fit_with,
    fit_without,
)
from shared.identification.fitting.cmaes import minimize
from shared.identification.fitting.fit import Fit, Start, polish, widened
from shared.identification.fitting.parameters import base_parameters, enter_base
from shared.identification.fitting.problem import Problem
from shared.identification.fitting.space import Space
from shared.identification.noise.floor import Noise
from tests.arms import JOINTS, write_arm
from tests.measured import measure, problem_of

PLANTED = {
    "damping elbow": 0.4, "armature lift": -0.3, "kp pan": 0.2, "kp lift": -0.15,
    "friction_loss elbow": 0.5,
}  # fmt: skip


def planted(folder: Path) -> Problem:
    """Return data without noise of an arm with another base, and what is fitted: no priors."""
    blank = measure(folder, np.random.default_rng(0), seconds=3.0)
    subject = subject_of(blank)
    parameters = tuple(
        replace(each, prior=np.inf) for each in base_parameters(subject) if each.name in PLANTED
    )
    x = np.array([PLANTED[each.name] for each in parameters])
    found = subject.nominal.run(
        [(lambda row: enter_base(parameters, x, row), each) for each in recorded_of(blank)]
    )
    trajectories = tuple(
        replace(trajectory, q=reports.q, tracker=reports.tracker)
        for trajectory, reports in zip(blank.trajectories, found, strict=True)
    )
    dataset: Dataset = replace(blank, trajectories=trajectories)
    noise = Noise(np.full(3, 1e-4), np.full(6, 1e-4), np.zeros(9), is_measured=True)
    return Problem(subject, dataset, parameters, noise)


@pytest.mark.parametrize("begins_at_bound", [False, True])
def test_a_planted_base_is_found_to_one_percent(tmp_path: Path, begins_at_bound: bool):
    problem = planted(tmp_path)
    space = Space(problem)
    start = np.zeros(space.size)
    names = [each.name for each in problem.parameters]
    if begins_at_bound:
        friction = names.index("friction_loss elbow")
        start[friction] = space.bounds[0][friction]
        assert problem.parameters[friction].value(start[friction]) == 0.0
    fit = polish(space, start, problem.of("train"), enough=1e-9)
    for each, z in zip(problem.parameters, fit.z, strict=True):
        assert each.value(z) == pytest.approx(each.value(PLANTED[each.name]), rel=0.01), each.name


def test_a_second_start_that_leads_to_the_first_fit_ends_there(tmp_path: Path):
    problem = problem_of(measure(tmp_path, np.random.default_rng(0), seconds=3.0))
    space, train = Space(problem), problem.of("train")
    first = polish(space, np.zeros(space.size), train)
    assert _from_elsewhere(space, np.full(space.size, 0.1), first, train) is first


def test_a_second_start_that_finds_better_is_fitted_by_itself(tmp_path: Path):
    problem = planted(tmp_path)
    space, train = Space(problem), problem.of("train")
    stuck = Fit.at(space, np.zeros(space.size), train)
    found = _from_elsewhere(space, np.full(space.size, 0.1), stuck, train)
    assert found is not stuck
    assert found.cost < 0.01 * stuck.cost
    np.testing.assert_allclose(found.jacobian, Fit.at(space, found.z, train).jacobian)


def test_cmaes_finds_the_bottom_of_a_bowl_within_bounds():
    wanted = np.array([0.3, -0.2, 2.0])

    def losses(zs: np.ndarray) -> np.ndarray:
        return np.sum((zs - wanted) ** 2, axis=1)

    low, high = np.full(3, -1.0), np.ones(3)
    found = minimize(losses, np.zeros(3), low, high, sigma=0.3, seed=4, generations=60)
    again = minimize(losses, np.zeros(3), low, high, sigma=0.3, seed=4, generations=60)
    assert found == pytest.approx([0.3, -0.2, 1.0], abs=0.02)
    assert np.array_equal(found, again)


@pytest.mark.parametrize("seed", range(8))
def test_no_number_is_surer_than_sure_where_two_do_the_same(seed: int):
    jacobian = np.random.default_rng(seed).normal(size=(100, 4))
    jacobian[:, 1] *= 1e7
    jacobian[:, 2] = (1.0 + 1e-12) * jacobian[:, 1]
    jacobian[:, 3] *= 1e-9
    space: Any = None  # not looked at
    fit = Fit.of(space, np.zeros(4), np.zeros(100), jacobian)
    variances = np.diag(fit.spread)
    assert (variances >= 0.0).all()
    assert variances[0] == pytest.approx(0.01, rel=0.4)


def test_nothing_to_search_is_found_at_once():
    empty = np.zeros(0)
    assert minimize(lambda zs: zs.sum(axis=1), empty, empty, empty, sigma=0.3, seed=1).size == 0


def test_what_is_taken_out_of_a_base_is_taken_out_of_the_derivative_at_the_nominal_model(
    tmp_path: Path,
):
    problem = planted(tmp_path)
    gone = [1, 3]
    kept = tuple(each for index, each in enumerate(problem.parameters) if index not in gone)
    full, space = Space(problem), Space(replace(problem, parameters=kept))
    whole = polish(full, np.zeros(full.size), problem.of("train"), 1)
    at_nominal = Start(np.zeros(full.size), full.jacobian(np.zeros(full.size), (0,))[1])
    in_parts = Space(problem.in_parts(WINDOW))
    parts = Fit.at(in_parts, whole.z, in_parts.problem.of("train"))
    found = fit_without(space, BaseFits(at_nominal, parts, whole), gone)
    _, wanted = space.jacobian(np.zeros(space.size), (0,))
    assert found.nominal.jacobian == pytest.approx(wanted)
    assert found.nominal.z == pytest.approx(np.zeros(space.size))
    assert found.whole.cost > whole.cost


def test_of_a_derivative_only_what_is_not_known_is_found_anew(tmp_path: Path):
    problem = planted(tmp_path)
    parameters = tuple(replace(each, prior=0.5) for each in problem.parameters)
    fewer, space = (
        Space(replace(problem, parameters=kept)) for kept in (parameters[:-2], parameters)
    )
    z, train = np.zeros(space.size), problem.of("train")
    _, kept = fewer.jacobian(z[:-2], train)
    wanted = space.jacobian(z, train, is_rough=True)[1]
    assert widened(space, z, kept, train, fewer.size) == pytest.approx(wanted)


def test_a_base_with_more_parameters_comes_further_down(tmp_path: Path):
    problem = planted(tmp_path)
    fewer, space = (
        Space(replace(problem, parameters=kept))
        for kept in (problem.parameters[:-1], problem.parameters)
    )
    rng = np.random.default_rng(0)
    done = fit_base(fewer, rng)
    found = fit_with(space, done, np.array([0.1]))
    wanted = fit_base(space, rng)
    assert found.whole.cost == pytest.approx(wanted.whole.cost, rel=1e-2, abs=1.0)
    assert found.whole.cost < 0.5 * done.whole.cost
    assert found.parts.z.size == found.nominal.z.size == space.size


def test_a_derivative_of_other_parts_is_taken_anew(tmp_path: Path):
    problem = planted(tmp_path)
    gone = [1, 3]
    kept = tuple(each for index, each in enumerate(problem.parameters) if index not in gone)
    full, space = Space(problem), Space(replace(problem, parameters=kept))
    whole = Fit.at(full, np.zeros(full.size), problem.of("train"))
    at_nominal = Start(np.zeros(full.size), full.jacobian(np.zeros(full.size), (0,))[1])
    in_parts = Space(replace(problem, parameters=kept).in_parts(WINDOW))
    found = fit_without(space, BaseFits(at_nominal, whole, whole), gone)
    assert len(found.parts.residual) == len(
        in_parts.residual([np.zeros(space.size)], in_parts.problem.of("train"))[0]
    )


def test_without_repeats_a_floor_under_torques_is_what_is_usual_block_by_block():
    rng = np.random.default_rng(0)
    growing = np.linspace(0.1, 3.0, 15)[:, None]
    parts = [growing * rng.standard_normal((15, 2)) for _ in range(400)]
    parts[7] *= 50.0  # something happened
    of_torques = _usual_power(parts, "torque") / 0.455
    assert of_torques == pytest.approx(np.full(2, np.mean(growing**2)), rel=0.1)
    assert (_usual_power(parts, "position") / 0.455 < 0.8 * np.mean(growing**2)).all()


def test_an_arm_under_torques_is_driven_by_what_was_commanded_friction_and_all(tmp_path: Path):
    path = write_arm(tmp_path, "torque")
    at = np.arange(0.0, 1.0, 0.01)
    still = np.zeros((len(at), 3))
    command = still + np.array([7.0, 0.0, 0.0])  # N m, and it does not move
    made = Trajectory("rubs", "train", "", np.zeros(3), np.zeros(3), at, command, at, still)
    source = ModelSource("mjcf", path, tracked="tool")
    dataset = Dataset(tmp_path, source, "torque", JOINTS, JOINTS, (made,), (), "")
    assert subject_of(dataset).drive[0] == pytest.approx(7.0)
    effort = still + np.array([9.0, 0.0, 0.0])
    logged = replace(dataset, trajectories=(replace(made, effort=effort),))
    assert subject_of(logged).drive[0] == pytest.approx(9.0)


class Bent:
    """Two numbers of which only the sum of their exponentials shows: a valley that bends."""

    size = 2
    bounds = (np.full(2, -5.0), np.full(2, 5.0))
    has_rough = False

    def __init__(self) -> None:
        self.derivatives = 0

    def clip(self, z: Float64) -> Float64:
        return z

    def residual(self, zs: list[Float64], segments: tuple[int, ...]) -> Float64:
        return np.stack([np.r_[100.0 * (np.exp(z).sum() - 4.0), 5.0 * z, 50.0] for z in zs])

    def jacobian(
        self, z: Float64, segments: tuple[int, ...], is_rough: bool
    ) -> tuple[Float64, Float64]:
        self.derivatives += 1
        own = np.concatenate([100.0 * np.exp(z)[None], 5.0 * np.eye(2), np.zeros((1, 2))])
        return self.residual([z], segments)[0], own


def test_the_less_is_enough_the_further_a_fit_follows_a_valley_that_bends():
    begun = np.array([1.3, np.log(4.0 - np.exp(1.3))])
    space: Any = Bent()
    assert polish(space, begun, (), 12, enough=1e-3).z[0] > 1.2
    space.derivatives = 0
    found = polish(space, begun, (), 12, enough=1e-6)
    assert found.z == pytest.approx(np.full(2, np.log(2.0)), abs=0.05)
    assert space.derivatives < 12  # each for several steps


def test_a_derivative_that_is_known_and_promises_nothing_is_believed():
    space: Any = Bent()
    found = polish(space, np.array([0.7, 0.68]), (), 12, enough=1e-6)
    space.derivatives = 0
    assert polish(space, found, (), 4) is found
    assert space.derivatives == 0
    rough = replace(found, is_rough=True)
    assert not polish(space, rough, (), 4).is_rough
    assert space.derivatives > 0
