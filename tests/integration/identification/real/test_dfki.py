"""The DFKI double pendulum: two hinges that rub, real recordings (RealAIGym, C.1)."""

from pathlib import Path

import pytest

from shared.identification.arm.subject import subject_of
from shared.identification.dataset.reading import read_dataset
from shared.identification.fitting.problem import Problem
from studies.real_data import dfki
from tests.integration.identification.real.fitting import Fitted, fitted, problem_of

RAW = Path(__file__).parents[5] / "shared/data/dfki_double_pendulum"
pytestmark = pytest.mark.skipif(not RAW.exists(), reason="needs the recordings of the shared data")


@pytest.fixture(scope="module")
def problem(tmp_path_factory: pytest.TempPathFactory) -> Problem:
    folder = tmp_path_factory.mktemp("dfki") / "set"
    dfki.convert(folder, RAW)
    return problem_of(folder)


@pytest.fixture(scope="module")
def dry(problem: Problem) -> Fitted:
    return fitted(problem, "coulomb_friction")


@pytest.mark.slow
@pytest.mark.timeout(600)
def test_both_joints_rub(problem: Problem, dry: Fitted):
    """A fit with all masses as the authors have them gives 0.21 and 0.20 N m."""
    plain = fitted(problem)
    assert dry.values["coulomb_friction shoulder"][0] == pytest.approx(0.2495, abs=0.01)
    assert dry.values["coulomb_friction elbow"][0] == pytest.approx(0.1897, abs=0.01)
    assert plain.test == pytest.approx(0.1197, abs=0.004)  # rad in windows of 0.3 s
    assert dry.test == pytest.approx(0.0247, abs=0.0015)


@pytest.mark.slow
@pytest.mark.timeout(600)
def test_viscous_friction_fits_but_fails_on_what_was_held_out(problem: Problem, dry: Fitted):
    damped = fitted(problem, "viscous_friction")
    assert damped.train == pytest.approx(0.0394, abs=0.003)
    assert damped.test == pytest.approx(0.1284, abs=0.006)
    assert damped.test > 4.0 * dry.test


@pytest.mark.slow
@pytest.mark.timeout(600)
def test_neither_viscous_friction_nor_a_delay_is_left_beside_it(problem: Problem, dry: Fitted):
    damped = fitted(problem, "coulomb_friction", "viscous_friction")
    late = fitted(problem, "coulomb_friction", "command_latency")
    assert damped.test == pytest.approx(0.97 * dry.test, rel=0.02)
    assert abs(damped.values["viscous_friction elbow"][0]) < 0.001
    assert late.test == pytest.approx(dry.test, rel=0.02)
    assert late.values["command_latency"][0] == pytest.approx(0.0011, abs=0.0006)  # half a step


def test_the_model_has_the_authors_numbers_and_no_friction(tmp_path: Path):
    dfki.convert(tmp_path / "set", RAW)
    dataset = read_dataset(tmp_path / "set")
    assert [(each.name, each.split) for each in dataset.trajectories] == [
        ("143339", "train"), ("143601", "train"), ("143747", "test"), ("144003", "test"),
    ]  # fmt: skip
    model = subject_of(dataset).nominal.model
    elbow = model.body("elbow").id
    assert model.body_mass[elbow] == pytest.approx(0.62557, abs=1e-5)
    about_joint = model.body_inertia[elbow, 0] + 0.62557 * model.body_ipos[elbow, 2] ** 2
    assert about_joint == pytest.approx(0.05087, abs=1e-5)
    assert model.dof_armature == pytest.approx([36 * 6.2872e-5] * 2, rel=1e-4)
    assert not model.dof_frictionloss.any()
    assert not model.dof_damping.any()
