"""A cheap refit comes near what a full fit finds."""

from pathlib import Path

import numpy as np
import pytest

from shared.identification.catalogue.torque_bias import EFFECT as BIAS
from shared.identification.effect import Candidate
from shared.identification.fit import Start, polish
from shared.identification.refit import refit
from shared.identification.screen import screen
from shared.identification.space import Space
from shared.sim.plant.row import Row
from tests.measured import measure, problem_of


def test_a_rough_refit_finds_the_size_with_the_base_beside_it(tmp_path: Path):
    def rub(row: Row) -> None:
        BIAS.enter(row, "elbow", np.array([0.5]))
        row.field("dof_armature")[row.dof("lift")] *= 1.3

    problem = problem_of(measure(tmp_path, np.random.default_rng(0), rub, seconds=4.0))
    space, train = Space(problem), problem.of("train")
    origin = np.zeros(space.size)
    nominal = Start(origin, space.jacobian(origin, train)[1])
    fit = polish(space, origin, train, 3)
    screened = screen(fit, [Candidate(BIAS, "elbow")], train)[0]
    rough = refit(fit, nominal, screened, train, fit)
    assert rough.space.size == space.size + 1
    assert rough.space.values(rough.z)[0][0] == pytest.approx(0.5, rel=0.1)
    full = polish(rough.space, rough.z, train)
    assert rough.ratio * fit.cost <= 1.05 * full.cost
    assert rough.ratio < 0.9
