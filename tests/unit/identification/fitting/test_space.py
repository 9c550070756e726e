"""The optimiser's vector: base first, then effects in probes."""

from dataclasses import replace

import numpy as np
import pytest

from shared.identification.catalogue.joint_elasticity import EFFECT as ELASTICITY
from shared.identification.catalogue.torque_bias import EFFECT as BIAS
from shared.identification.catalogue.viscous_friction import EFFECT as VISCOUS
from shared.identification.effect import Candidate
from shared.identification.fitting.problem import Problem
from shared.identification.fitting.space import Space
from shared.sim.plant.plant import stepped
from shared.sim.plant.rollouts import Rollouts
from tests.measured import measure, problem_of


@pytest.fixture(scope="module")
def problem(tmp_path_factory: pytest.TempPathFactory) -> Problem:
    folder = tmp_path_factory.mktemp("data")
    return problem_of(measure(folder, np.random.default_rng(0), seconds=2.0))


def test_effects_follow_the_base_in_probes(problem: Problem):
    one, other = Candidate(BIAS, "elbow"), Candidate(VISCOUS, "lift")
    space = Space(problem).grown(one).grown(other)
    n = len(problem.parameters)
    assert space.size == n + 2
    z = np.r_[np.zeros(n), 2.0, 0.5]
    probes = [each.probe for each in space.quantities]
    assert [value.tolist() for value in space.values(z)] == [[2.0 * probes[0]], [0.5 * probes[1]]]
    low, high = space.bounds
    assert np.all(low <= 0.0)
    assert np.all(high > 0.0)
    assert space.bounds[1][n] == pytest.approx(space.quantities[0].high / probes[0])
    assert np.all(np.isinf(space.priors[n:]))


def test_an_effects_numbers_are_dropped_from_a_vector(problem: Problem):
    candidates = tuple(Candidate(BIAS, joint) for joint in ("pan", "lift", "elbow"))
    space = Space(problem, candidates)
    n = len(problem.parameters)
    assert [space.where(each) for each in candidates] == [
        slice(n + index, n + index + 1) for index in range(3)
    ]
    with pytest.raises(ValueError, match="viscous_friction pan is not fitted"):
        space.where(Candidate(VISCOUS, "pan"))


def test_a_derivative_is_what_a_small_step_changes(problem: Problem):
    space = Space(problem, (Candidate(BIAS, "elbow"),))
    train = problem.of("train")
    z = np.zeros(space.size)
    residual, jacobian = space.jacobian(z, train)
    assert jacobian.shape == (len(residual), space.size)
    _, last = space.jacobian(z, train, range(space.size - 1, space.size))
    assert np.array_equal(last[:, 0], jacobian[:, -1])
    moved = z.copy()
    moved[-1] = 0.01
    change = (space.residual([moved], train)[0] - residual) / 0.01
    assert np.allclose(change, jacobian[:, -1])


def test_a_rough_derivative_is_taken_by_a_longer_step_where_the_arm_has_one(problem: Problem):
    def at(timestep: float) -> Space:
        plant = stepped(problem.subject.plant, timestep)
        subject = replace(problem.subject, plant=plant, nominal=Rollouts(plant, (), 8))
        other = Problem(subject, problem.dataset, problem.parameters, problem.noise)
        return Space(other, (Candidate(BIAS, "elbow"),))

    train, own = problem.of("train"), problem.subject.plant.timestep
    short, long = at(0.25 * own), Space(problem, (Candidate(BIAS, "elbow"),))
    assert short.problem.subject.plant.rough_timestep == own
    assert long.problem.subject.plant.rough_timestep is None
    z = np.zeros(long.size)
    assert short.has_rough
    assert not long.has_rough
    residual, jacobian = short.jacobian(z, train, is_rough=True)
    np.testing.assert_array_equal(residual, short.residual([z], train)[0])
    assert not np.allclose(residual, long.residual([z], train)[0], atol=0.01)
    np.testing.assert_allclose(jacobian, long.jacobian(z, train)[1], atol=1e-9)
    _, fine = short.jacobian(z, train)
    assert not np.allclose(jacobian, fine, rtol=1e-3)
    assert np.linalg.norm(jacobian - fine) < 0.1 * np.linalg.norm(fine)


def test_a_spring_has_a_rough_derivative_too(problem: Problem):
    subject = replace(problem.subject, plant=stepped(problem.subject.plant, 0.001))
    other = Problem(subject, problem.dataset, problem.parameters, problem.noise)
    space, train = Space(other, (Candidate(ELASTICITY, "elbow"),)), other.of("train")
    z = np.r_[np.zeros(space.size - 1), 1.0]
    (_, fine), (_, rough) = (space.jacobian(z, train, is_rough=each) for each in (False, True))
    assert np.linalg.norm(rough - fine) < 0.1 * np.linalg.norm(fine)


def test_a_longer_step_is_none_for_what_a_change_changes(problem: Problem):
    plant = problem.subject.plant
    assert stepped(plant, 2.0 * plant.timestep).rough_timestep is None


def test_what_is_known_beforehand_speaks_against_leaving_nominal(problem: Problem):
    space = Space(problem)
    z = np.full(space.size, 0.05)
    prior = space.residual([z], problem.of("train"))[0][-space.size :]
    assert prior == pytest.approx(z / space.priors)


def test_at_an_upper_bound_the_step_goes_back(problem: Problem):
    space = Space(problem)
    z = np.zeros(space.size)
    z[-1] = space.bounds[1][-1]
    _, jacobian = space.jacobian(z, problem.of("train"), range(space.size - 1, space.size))
    assert np.isfinite(jacobian).all()
    assert jacobian[-1, 0] == pytest.approx(1.0 / space.priors[-1])
