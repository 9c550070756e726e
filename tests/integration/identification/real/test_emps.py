"""EMPS: one carriage, real recordings (Janot, Gautier, Brunot 2019)."""

from pathlib import Path

import numpy as np
import pytest
from scipy.io import loadmat

from shared.identification.dataset.reading import read_dataset
from shared.identification.find import identify
from shared.identification.fitting.base import floor_from_base
from shared.identification.fitting.fit import polish
from shared.identification.fitting.problem import Problem
from shared.identification.fitting.space import Space
from shared.identification.leftover.located import leftovers
from studies.real_data import emps
from tests.integration.identification.real.fitting import Fitted, fitted, problem_of

RAW = Path(__file__).parents[5] / "shared/data/emps"
pytestmark = pytest.mark.skipif(not RAW.exists(), reason="needs the recordings of the shared data")


@pytest.fixture(scope="module")
def problem(tmp_path_factory: pytest.TempPathFactory) -> Problem:
    folder = tmp_path_factory.mktemp("emps") / "set"
    emps.convert(folder, RAW)
    return problem_of(folder)


@pytest.fixture(scope="module")
def rubbing(problem: Problem) -> Fitted:
    return fitted(problem, "coulomb_friction", "torque_bias")


@pytest.mark.slow
@pytest.mark.timeout(600)
def test_the_carriage_rubs_and_is_pushed_as_its_makers_found(rubbing: Fitted):
    """Janot et al.: 95.1 kg, 203.5 N s/m, 20.4 N, -3.16 N (what the drive has to give)."""
    found = rubbing.values
    assert found["mass carriage"][0] == pytest.approx(95.1, rel=0.03)
    assert found["damping carriage"][0] == pytest.approx(203.5, rel=0.08)
    assert found["coulomb_friction carriage"][0] == pytest.approx(20.4, rel=0.08)
    assert found["torque_bias carriage"][0] == pytest.approx(3.16, abs=0.3)


@pytest.mark.slow
@pytest.mark.timeout(600)
def test_dry_friction_and_an_offset_take_off_most_of_what_is_held_out(
    problem: Problem, rubbing: Fitted
):
    plain, dry = fitted(problem), fitted(problem, "coulomb_friction")
    assert 1e3 * plain.test == pytest.approx(1.30, abs=0.03)  # mm in windows of 0.3 s
    assert 1e3 * dry.test == pytest.approx(0.66, abs=0.03)
    assert 1e3 * rubbing.test == pytest.approx(0.314, abs=0.02)


@pytest.mark.slow
@pytest.mark.timeout(600)
def test_an_asymmetric_viscous_friction_says_the_same_as_the_offset_and_more(
    problem: Problem, rubbing: Fitted
):
    """So does a regression of the forces while it moves: -0.2 N and -37.6 N s/m together."""
    both = fitted(problem, "coulomb_friction", "torque_bias", "asymmetric_friction")
    alone = fitted(problem, "coulomb_friction", "asymmetric_friction")
    assert alone.values["asymmetric_friction carriage"][0] == pytest.approx(-39.2, abs=1.5)
    assert abs(both.values["torque_bias carriage"][0]) < 0.5
    assert 1e3 * alone.test == pytest.approx(0.223, abs=0.012)
    assert alone.test < 0.9 * rubbing.test
    assert both.test > 0.98 * alone.test


@pytest.mark.slow
@pytest.mark.timeout(600)
def test_friction_that_weakens_with_speed_says_nothing_beside_it(problem: Problem):
    alone = fitted(problem, "coulomb_friction", "asymmetric_friction")
    bent = fitted(problem, "coulomb_friction", "asymmetric_friction", "nonlinear_viscous")
    assert bent.test == pytest.approx(alone.test, rel=0.02)


@pytest.mark.slow
@pytest.mark.timeout(600)
def test_pulses_that_the_commands_do_not_know_are_external_and_when_they_were(tmp_path: Path):
    """Half the recording is pushed with 175.8 N, and friction is not in the model either."""
    emps.convert(tmp_path / "hidden", RAW, "hidden")
    guess = problem_of(tmp_path / "hidden")
    noise = floor_from_base(Space(guess))
    hidden = Problem(guess.subject, guess.dataset, guess.parameters, noise)
    space = Space(hidden)
    fit = polish(space, np.zeros(space.size), hidden.of("train"), 4)
    found = leftovers(hidden, space.variant(fit.z), range(len(hidden.segments)))
    pulses = np.asarray(loadmat(RAW / emps.FILES["pulses"])["pulses_N"], np.float64).ravel()
    at = np.flatnonzero(np.diff(pulses, append=0.0)) * 1e-3
    assert len(at) == 50
    assert {(each.where, each.trajectory, each.phase, each.is_external) for each in found} == {
        ("carriage", "pulses", "at times", True)
    }
    assert sorted(each.begin for each in found) == pytest.approx(at[0::2], abs=0.05)
    assert sorted(each.end for each in found) == pytest.approx(at[1::2], abs=0.05)
    torques = [each.torque for each in found]
    assert torques == pytest.approx([175.8] * 25, rel=0.1)


@pytest.mark.slow
@pytest.mark.timeout(600)
def test_the_verdict_names_the_friction_and_calls_each_pulse_external(tmp_path: Path):
    emps.convert(tmp_path / "hidden", RAW, "hidden")
    verdict = identify(read_dataset(tmp_path / "hidden"), seed=1).verdict
    assert verdict.verdict == "named"
    friction, asymmetry = verdict.causes
    assert (friction.effect, asymmetry.effect) == ("coulomb_friction", "asymmetric_friction")
    assert friction.value == pytest.approx(20.4, rel=0.1)  # what the authors have
    outside = [each for each in verdict.unexplained if each.is_external]
    assert len(outside) == len(verdict.unexplained) == 25
    begins = sorted(each.begin for each in outside)
    assert np.diff(begins) == pytest.approx(np.ones(24), abs=0.05)
    assert [each.torque for each in outside] == pytest.approx([175.8] * 25, rel=0.1)


def test_the_pulses_are_volts_and_the_voltage_log_has_them(tmp_path: Path):
    emps.convert(tmp_path / "known", RAW)
    emps.convert(tmp_path / "hidden", RAW, "hidden")
    known, hidden = (read_dataset(tmp_path / name).test[0] for name in ("known", "hidden"))
    pulse = (known.command - hidden.command)[:, 0]
    assert np.unique(np.round(pulse, 6)).tolist() == [
        pytest.approx(0.0, abs=1e-5),
        pytest.approx(175.753, abs=1e-3),
    ]
    steps = np.round(np.diff(pulse), 6)
    edges = np.flatnonzero(steps)
    jumps = np.diff(known.command[:, 0])[edges] * np.sign(steps[edges])
    assert len(edges) == 49
    assert np.median(jumps) == pytest.approx(178.0, abs=6.0)
    assert abs(np.median(np.diff(hidden.command[:, 0])[edges])) < 6.0
    np.testing.assert_array_equal(known.q, hidden.q)
