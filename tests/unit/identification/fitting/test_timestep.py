"""The error of a time step: what is left of it where it can be worked out, and when it is told."""

from dataclasses import replace

import numpy as np
import pytest

from shared.identification.fitting.fit import Fit, polish
from shared.identification.fitting.space import Space
from shared.identification.fitting.timestep import changed_by, coarse_step, shorter, step_error
from tests.measured import measure, problem_of


@pytest.fixture(scope="module")
def fit(tmp_path_factory: pytest.TempPathFactory) -> Fit:
    dataset = measure(tmp_path_factory.mktemp("data"), np.random.default_rng(0), seconds=2.0)
    space = Space(problem_of(dataset))
    return polish(space, np.zeros(space.size), space.problem.of("train"), steps=0)


def with_noise(fit: Fit, factor: float) -> Fit:
    """Return a fit whose joints' noise floor is so many times as large."""
    problem = fit.space.problem
    noise = replace(problem.noise, joints=factor * problem.noise.joints)
    space = Space(replace(problem, noise=noise))
    return replace(fit, space=space)


def test_it_is_what_far_smaller_steps_change(fit: Fit):
    expected = changed_by(fit, fit.space.problem.subject.plant.timestep / 16)
    np.testing.assert_allclose(step_error(fit), expected, rtol=0.15)


def test_it_is_told_where_encoders_show_it(fit: Fit):
    off = float(step_error(fit).max())
    assert coarse_step(with_noise(fit, 1.01 * off)) == ""
    told = coarse_step(with_noise(fit, off / 8.1))
    assert "at 2 ms" in told
    assert "8.1 times the noise" in told
    assert "timestep=6e-05 leaves 0.5" in told  # a 32nd


def test_a_quarter_is_tried_where_encoders_show_it(fit: Fit):
    off = float(step_error(fit).max())
    step = fit.space.problem.subject.plant.timestep
    assert shorter(with_noise(fit, 1.01 * off)) is None
    assert shorter(with_noise(fit, 0.99 * off)) == step / 4.0
