"""A cheap refit comes near what a full fit finds."""

from pathlib import Path

import numpy as np
import pytest

from shared.identification.arm.segments import thinned
from shared.identification.catalogue.external_contact import EFFECT as PUSH
from shared.identification.catalogue.torque_bias import EFFECT as BIAS
from shared.identification.dataset.types import Float64
from shared.identification.effect import Candidate
from shared.identification.fitting.fit import Fit, Start, descend, polish
from shared.identification.fitting.refit import refit, settle
from shared.identification.fitting.space import Space
from shared.identification.search.screen import screen
from shared.identification.search.windows import closer
from shared.sim.plant.row import Row
from tests.measured import measure, problem_of


def fit_without_bias(folder: Path, torque: float) -> tuple[Fit, tuple[int, ...]]:
    """Return a base that was fitted to an arm with a torque that it lacks, and recordings."""

    def push(row: Row) -> None:
        BIAS.enter(row, "elbow", np.array([torque]))

    problem = problem_of(measure(folder, np.random.default_rng(0), push, seconds=4.0))
    space, train = Space(problem), problem.of("train")
    return polish(space, np.zeros(space.size), train, 3), train


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


def test_what_happened_once_is_fitted_to_the_part_in_which_it_was(tmp_path: Path):
    def push(row: Row) -> None:
        PUSH.enter(row, "elbow in first", np.array([1.0, 1.6, 0.3]))

    problem = problem_of(measure(tmp_path, np.random.default_rng(0), push, seconds=4.4))
    problem = problem.in_parts(1.0)
    space, train = Space(problem), problem.of("train")
    assert train[1] not in thinned(problem.segments, train)
    origin = np.zeros(space.size)
    nominal = Start(origin, space.jacobian(origin, train)[1])
    fit = polish(space, origin, train, 3)
    (screened,) = (
        each
        for each in screen(fit, [Candidate(PUSH, "elbow in first")], train)
        if each.candidate.place == "elbow in first"
    )
    rough = refit(fit, nominal, closer(fit, screened, train), train, fit)
    torque, begin, length = rough.space.values(rough.z)[0]
    assert torque * length == pytest.approx(0.3, rel=0.25)
    assert (begin, length) == pytest.approx((1.6, 0.3), abs=0.1)
    everywhere = 0.5 * float(np.sum(rough.space.residual([rough.z], train)[0] ** 2))
    assert rough.ratio == pytest.approx(everywhere / fit.cost, rel=0.02)


def test_a_slight_cause_is_fitted_with_the_derivative_of_the_base(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    fit, train = fit_without_bias(tmp_path, 0.02)
    space = fit.space.grown(Candidate(BIAS, "elbow"))
    start = np.r_[fit.z, 0.0]
    own = settle(space, start, train)
    asked: list[range | None] = []
    derivative = Space.jacobian

    def counted(
        self: Space, z: Float64, segments: tuple[int, ...], only: range | None = None,
        is_rough: bool = False,
    ):  # fmt: skip
        asked.append(only)
        return derivative(self, z, segments, only, is_rough)

    monkeypatch.setattr(Space, "jacobian", counted)
    kept = settle(space, start, train, known=fit)
    assert asked == [range(fit.space.size, space.size)]
    assert kept.cost == pytest.approx(own.cost, rel=1e-3)
    assert kept.z[-1] == pytest.approx(own.z[-1], rel=0.02)


@pytest.mark.parametrize("torque", [2.0, 4.0])
def test_a_cause_that_bends_the_base_gets_a_derivative_of_its_own(tmp_path: Path, torque: float):
    fit, train = fit_without_bias(tmp_path, torque)
    space = fit.space.grown(Candidate(BIAS, "elbow"))
    start = np.r_[fit.z, 0.0]
    found = settle(space, start, train, known=fit)
    without = descend(space, [start], fit.jacobian, train, fit.space.size)
    assert found.cost < 0.1 * fit.cost
    assert found.cost < 0.6 * without.cost


def test_a_full_fit_comes_down_however_far_the_base_was_bent(tmp_path: Path):
    fit, train = fit_without_bias(tmp_path, 4.0)
    space = fit.space.grown(Candidate(BIAS, "elbow"))
    found = polish(space, np.r_[fit.z, 0.0], train)
    # Steps that are damped little all lead too far, ones that are damped much take 0.4 % off.
    assert found.cost < 0.05 * fit.cost
