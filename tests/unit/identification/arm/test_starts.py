"""Repeats that start in another state than what they repeat."""

from pathlib import Path

import numpy as np
import pytest

from shared.identification.arm.subject import subject_of
from shared.identification.dataset.types import Dataset
from shared.identification.fitting.parameters import base_parameters
from shared.identification.fitting.problem import BLOCK, Problem, Variant
from shared.identification.hidden.generator import hide
from shared.identification.hidden.recipe import Recipe
from shared.identification.noise.floor import noise_of, repeat_differences
from tests.measured import JOINT_NOISE, TRACKER_NOISE, measure


@pytest.fixture(scope="module")
def elsewhere(tmp_path_factory: pytest.TempPathFactory) -> Dataset:
    """A repeat that starts up to 0.3 rad from what it repeats; no reading knows it to 1e-4."""
    folder = tmp_path_factory.mktemp("elsewhere")
    return measure(
        folder, np.random.default_rng(0), seconds=2.0, again_from=np.array([0.3, -0.2, 0.1])
    )


def rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def test_what_follows_from_the_start_is_not_noise(elsewhere: Dataset):
    starts = subject_of(elsewhere).starts
    (raw,) = repeat_differences(elsewhere, BLOCK, {})
    (corrected,) = repeat_differences(elsewhere, BLOCK, starts)
    assert raw.tracker is not None
    assert corrected.tracker is not None
    # two recordings, two readings a block: the noise of a reading
    assert rms(corrected.joints) == pytest.approx(JOINT_NOISE, rel=0.1)
    assert rms(raw.joints) > 50.0 * JOINT_NOISE
    assert rms(corrected.tracker[:, :3]) == pytest.approx(TRACKER_NOISE, rel=0.15)
    assert rms(raw.tracker[:, :3]) > 5.0 * TRACKER_NOISE


def test_repeats_that_start_alike_are_not_corrected(tmp_path: Path):
    alike = measure(tmp_path, np.random.default_rng(0), seconds=1.0)
    assert subject_of(alike).starts == {}


def test_the_floor_of_a_data_set_is_that_of_its_readings(elsewhere: Dataset):
    found = noise_of(elsewhere, BLOCK, subject_of(elsewhere).starts)
    assert found.is_measured
    assert found.joints == pytest.approx(np.full(3, JOINT_NOISE / np.sqrt(2.0)), rel=0.2)


def test_repeats_of_an_arm_that_nothing_holds_are_compared_part_by_part(tmp_path: Path):
    recipe = Recipe(arm="torque2", seed=9670, spread=0.0, seconds=4.0)
    dataset = hide(tmp_path / "set", recipe)
    subject = subject_of(dataset)
    raw, corrected = (noise_of(dataset, BLOCK, starts) for starts in ({}, subject.starts))
    assert (corrected.joints < 0.5 * raw.joints).all()
    # nothing is wrong with the model: what it leaves is noise
    problem = Problem(subject, dataset, base_parameters(subject), corrected)
    right = Variant(np.zeros(len(problem.parameters)))
    left = problem.vector([right], problem.of("test"))
    assert np.mean(left**2) == pytest.approx(1.0, abs=0.3)
