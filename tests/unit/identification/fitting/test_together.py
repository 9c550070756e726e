"""All that moves an arm, and all that resists, larger together."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from shared.identification.catalogue.joint_elasticity import EFFECT as ELASTICITY
from shared.identification.catalogue.torque_bias import EFFECT as BIAS
from shared.identification.effect import Candidate
from shared.identification.fitting.fit import Fit
from shared.identification.fitting.problem import Problem
from shared.identification.fitting.space import Space
from shared.identification.fitting.together import larger, power_of_force, with_all_together
from tests.measured import measure, problem_of


@pytest.fixture(scope="module")
def problem(tmp_path_factory: pytest.TempPathFactory) -> Problem:
    folder: Path = tmp_path_factory.mktemp("data")
    return problem_of(measure(folder, np.random.default_rng(0), seconds=4.0))


@pytest.mark.parametrize(
    ("unit", "power"),
    [
        ("N m", 1.0), ("N", 1.0), ("kg m^2", 1.0), ("N m s/rad", 1.0), ("N m/rad", 1.0),
        ("rad/(N m)", -1.0), ("1/(N m)", -1.0), ("1/N", -1.0), ("sqrt(kg) m", 0.5),
        ("rad", 0.0), ("s", 0.0), ("1", 0.0), ("1/(rad/s^2)", 0.0), ("", 0.0),
    ],
)  # fmt: skip
def test_a_unit_says_how_a_number_grows(unit: str, power: float):
    assert power_of_force(unit) == power


def test_an_arm_with_all_of_it_larger_moves_the_same(problem: Problem):
    space = Space(problem, (Candidate(BIAS, "elbow"), Candidate(ELASTICITY, "lift")))
    train = problem.of("train")
    z = np.zeros(space.size)
    for candidate in space.candidates:
        z[space.where(candidate).start] = 0.5
    before, after = space.residual([z, larger(space, z, 0.2)], train)
    rows = len(before) - space.size
    half = z.copy()
    half[: space.base_size] = 0.2
    other = space.residual([half], train)[0]
    came, without = (np.linalg.norm((each - before)[:rows]) for each in (after, other))
    assert came < 1e-2 * without


def test_a_derivative_says_so_and_stays_what_it_is_otherwise(problem: Problem):
    space, train = Space(problem, (Candidate(BIAS, "elbow"),)), problem.of("train")
    z = np.zeros(space.size)
    z[-1] = 0.5
    fit = Fit.at(space, z, train)
    found = with_all_together(fit, train)
    way = larger(space, z, 0.02) - z
    shown, before = (np.linalg.norm((each.jacobian @ way)[: -space.size]) for each in (found, fit))
    assert shown < 0.01 * before
    across = np.zeros(space.size)
    across[0], across[1] = way[1], -way[0]
    np.testing.assert_allclose(found.jacobian @ across, fit.jacobian @ across, atol=1e-9)


def test_of_an_arm_that_torques_drive_nothing_is_asked(problem: Problem):
    plant = replace(problem.subject.plant, control="torque")
    other = replace(problem, subject=replace(problem.subject, plant=plant))
    space, train = Space(problem), problem.of("train")
    fit = replace(Fit.at(space, np.zeros(space.size), train), space=Space(other))
    assert with_all_together(fit, train) is fit
