"""The noise floor of an arm whose commands answer what happens to it."""

from dataclasses import replace

import numpy as np
import pytest

from shared.identification.arm.parts import CUTS
from shared.identification.arm.subject import subject_of
from shared.identification.dataset.reading import read_dataset
from shared.identification.dataset.types import Dataset
from shared.identification.noise.answered import answered_noise, answers
from studies.other_arms.arms import ARMS
from studies.other_arms.recording import convert

CUT = CUTS["torque"]
ARM = replace(ARMS["three"], push=0.0, noise=1e-4)
"""Nothing pushes it: repeats differ by readings, and by what the controller makes of them."""
STARTS = np.full((2, 3), 1.0)
"""Nothing is known of first states."""


@pytest.fixture(scope="module")
def dataset(tmp_path_factory: pytest.TempPathFactory) -> Dataset:
    """An arm under a controller that is not in its file, with nothing wrong."""
    folder = tmp_path_factory.mktemp("answered") / "set"
    convert(folder, ARM, "none", 4.0, 1, 0.0005)
    return read_dataset(folder)


def test_commands_given_twice_that_differ_answer(dataset: Dataset):
    assert not answers(dataset)  # nothing pushed it: there was nothing to answer
    other = tuple(
        replace(each, command=1.01 * each.command) if each.repeats else each
        for each in dataset.trajectories
    )
    assert answers(replace(dataset, trajectories=other))


def test_beyond_first_states_repeats_differ_as_readings_do(dataset: Dataset):
    nominal = subject_of(dataset).nominal
    found = answered_noise(dataset, nominal, CUT, 0.02, STARTS, np.zeros(3))
    assert found is not None
    assert found.drift is not None
    reading = ARM.noise * np.sqrt(ARM.period / 0.02)
    grown = found.levels * found.drift.spread(found.blocks)
    assert grown[0] == pytest.approx(np.full(3, reading), rel=0.3)
    assert np.all(grown[-1] < 5.0 * reading)  # nothing pushes it
    assert np.all(found.correlation < 0.3)


def test_recordings_too_short_for_parts_say_nothing(dataset: Dataset):
    short = tuple(
        replace(each, joints_at=each.joints_at[:9], q=each.q[:9]) for each in dataset.trajectories
    )
    nominal = subject_of(dataset).nominal
    cut = replace(dataset, trajectories=short)
    assert answered_noise(cut, nominal, CUT, 0.02, STARTS, np.zeros(3)) is None
