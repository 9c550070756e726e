"""Intervals of fitted numbers, where residuals correlate and stretches are few."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest

from shared.identification.catalogue.cogging import EFFECT as COGGING
from shared.identification.catalogue.gravity_tilt import EFFECT as TILT
from shared.identification.catalogue.stribeck_friction import EFFECT as STRIBECK
from shared.identification.effect import Candidate, Effect
from shared.identification.fitting.fit import Fit, polish
from shared.identification.fitting.space import Space
from shared.identification.gate.certainty import (
    CALIBRATED,
    SURE,
    _errors,  # pyright: ignore[reportPrivateUsage]
    half_widths,
    is_there,
)
from tests.measured import measure, problem_of


@dataclass
class Line:
    """Stands in for a space and its problem, of one recording."""

    shape: tuple[int, int]
    """Blocks, channels."""
    base_size: int = 0

    @property
    def problem(self) -> "Line":
        return self

    def shape_of(self, segment: int) -> tuple[int, int]:
        return self.shape


@pytest.mark.parametrize(("stretches", "numbers"), [(8, 2), (16, 8), (16, 14)])
def test_intervals_cover_though_residuals_correlate(stretches: int, numbers: int):
    rng = np.random.default_rng(2)
    rows, channels, covered = 25 * stretches, 3, []
    for _ in range(80):
        columns = rng.standard_normal((rows, channels, numbers)).cumsum(axis=0)
        columns /= columns.std(axis=0)
        noise = rng.standard_normal((rows, channels))
        for index in range(1, rows):
            noise[index] = 0.6 * noise[index - 1] + 0.8 * noise[index]
        jacobian = columns.reshape(-1, numbers)
        z = -np.linalg.lstsq(jacobian, noise.ravel(), rcond=None)[0]
        residual = noise.ravel() + jacobian @ z
        padding = np.zeros((numbers, numbers))
        fit = Fit(cast(Any, Line((rows, channels))), z, np.r_[residual, np.zeros(numbers)],
                  np.concatenate([jacobian, padding]), 0.0)  # fmt: skip
        covered.append(np.mean(np.abs(z) <= half_widths(fit, (0,))))
    assert 0.91 <= np.mean(covered) <= 0.99


def test_what_residuals_do_not_show_of_the_base_is_as_unsure_as_beforehand():
    """Scores of residuals have nothing of it, so by them alone it would be known exactly."""
    rng = np.random.default_rng(3)
    column, prior = rng.standard_normal((400, 1)), 1.5
    jacobian = np.r_[np.c_[column, 1e-6 * column], np.diag([1e-3, 1.0 / prior])]
    space = Line((400, 1), base_size=2)
    fit = Fit(cast(Any, space), np.zeros(2), rng.standard_normal(402), jacobian, 0.0)
    shown, hidden = half_widths(fit, (0,))
    assert shown < 0.2
    assert hidden == pytest.approx(1.96 * prior, rel=0.1)


def test_a_cause_that_hardly_differs_from_that_is_as_unsure():
    """The second number is of the base, the third a cause that only together with it shows."""
    rng = np.random.default_rng(4)
    column, prior = rng.standard_normal((400, 1)), 0.1
    jacobian = np.r_[np.c_[1e-3 * column, column, column], np.diag([1.0, 1.0 / prior, 0.0])]
    space = Line((400, 1), base_size=2)
    fit = Fit(cast(Any, space), np.zeros(3), rng.standard_normal(403), jacobian, 0.0)
    cause = half_widths(fit, (0,))[2]
    assert cause == pytest.approx(1.96 * np.hypot(prior, 400**-0.5), rel=0.15)


@pytest.mark.parametrize(
    ("effect", "place", "is_enough"), [(STRIBECK, "elbow", False), (TILT, "", True)]
)
def test_a_cause_is_there_if_what_is_sure_of_it_does_something(
    tmp_path: Path, effect: Effect, place: str, is_enough: bool
):
    """Of friction that falls off with speed, a sure speed is nothing; of a tilt one angle is."""
    space = Space(problem_of(measure(tmp_path, np.random.default_rng(0), seconds=2.0)))
    candidate = Candidate(effect, place)
    grown, train = space.grown(candidate), space.problem.of("train")
    fit = polish(grown, np.zeros(grown.size), train, 2)
    own = slice(space.size, space.size + 2)
    widths = CALIBRATED * half_widths(fit, train)[own]
    for sure, expected in (((0.0, 0.0), False), ((0.0, 10.0), is_enough), ((10.0, 0.0), True)):
        z = fit.z.copy()
        z[own] = np.array(sure) * np.maximum(widths, 0.1)
        assert is_there(replace(fit, z=z), candidate, train) == expected


def test_a_ripple_is_there_though_its_phase_makes_one_of_its_two_sizes_nothing(tmp_path: Path):
    space = Space(problem_of(measure(tmp_path, np.random.default_rng(0), seconds=2.0)))
    candidate = Candidate(COGGING, "elbow")
    grown, train = space.grown(candidate), space.problem.of("train")
    often = COGGING.quantities(space.problem.subject, "elbow")[2]
    start = np.r_[np.zeros(grown.size - 1), often.grid[0] / often.probe]
    fit = Fit.at(grown, start, train)
    widths = CALIBRATED * half_widths(fit, train)[-3:-1]
    for sure, expected in (((0.0, 0.0), False), ((0.0, 10.0), True), ((10.0, 0.0), True)):
        z = np.r_[start[:-3], np.array(sure) * np.maximum(widths, 0.1), start[-1]]
        assert is_there(replace(fit, z=z), candidate, train) == expected


def test_numbers_of_which_only_a_sum_is_known_are_surely_something_together():
    covariance = np.array([[1.0, -0.97], [-0.97, 1.0]])
    z = 1.5 * CALIBRATED * np.ones(2)
    one, both = np.array([0]), np.array([0, 1])
    assert _errors(z, covariance, 30, one) < SURE < _errors(z, covariance, 30, both)
    assert _errors(z * [1.0, -1.0], covariance, 30, both) < SURE
    assert _errors(z, covariance, 2, both) == 0.0  # hardly anything to tell it from


def test_standard_errors_are_those_of_a_normal_number_that_is_as_seldom_so_far_off():
    one = np.array([0])
    for times in (0.5, 2.0, 4.0):
        z = np.array([times * CALIBRATED])
        assert _errors(z, np.eye(1), 10_000, one) == pytest.approx(times, rel=1e-3)
        assert _errors(z, np.eye(1), 10, one) < times  # of few stretches less is sure
    assert np.isfinite(_errors(np.array([1e6]), np.eye(1), 32, one))


def test_of_what_is_nothing_a_twentieth_looks_sure():
    rng = np.random.default_rng(0)
    spread = rng.normal(size=(3, 3))
    sure = 0
    for _ in range(2000):
        seen = rng.normal(size=(13, 3)) @ spread.T
        told = np.cov(seen, rowvar=False) / 13.0 / CALIBRATED**2
        sure += _errors(seen.mean(axis=0), told, 12, np.arange(3)) > SURE
    assert 0.035 < sure / 2000 < 0.065
