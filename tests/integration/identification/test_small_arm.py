"""The stand-in for a small whole arm does what its command line says it does."""

from pathlib import Path

import numpy as np
import pytest

from shared.identification.dataset.reading import read_dataset
from shared.identification.dataset.types import Dataset
from studies.other_arms.small_arm import JOINTS, Wrong, convert

LIKE_ITS_MODEL = Wrong(delay=0.0, friction=1.0, at_rest=0.0)


def recorded(folder: Path, wrong: Wrong) -> Dataset:
    convert(folder, wrong, seconds=4.0, seed=3)
    return read_dataset(folder)


@pytest.fixture(scope="module")
def plain(tmp_path_factory: pytest.TempPathFactory) -> Dataset:
    return recorded(tmp_path_factory.mktemp("small") / "plain", LIKE_ITS_MODEL)


def test_it_is_logged_as_such_arms_are(plain: Dataset):
    assert plain.joints == JOINTS
    assert [each.split for each in plain.trajectories] == ["train"] * 3 + ["test"] * 2
    for each in plain.trajectories:
        assert np.diff(each.joints_at) == pytest.approx(0.02)
        steps = each.q / (2.0 * np.pi / 4096)
        assert steps == pytest.approx(np.round(steps), abs=1e-6)
        assert not each.repeats


def test_commands_come_late_by_what_was_asked_for(plain: Dataset, tmp_path: Path):
    late = recorded(tmp_path / "late", Wrong(delay=0.1, friction=1.0, at_rest=0.0))
    for one, other in zip(plain.trajectories, late.trajectories, strict=True):
        same = one.q[:-5] - other.q[5:]  # five readings of 20 ms
        assert same.std() < 0.2 * (one.q - other.q).std()


def test_joints_that_stick_follow_worse(plain: Dataset, tmp_path: Path):
    sticks = recorded(tmp_path / "sticks", Wrong(delay=0.0, friction=6.0, at_rest=1.2))
    slow = ("sines", "multisine")  # in steps the servo's own lag is most of it
    for one, other in zip(plain.trajectories, sticks.trajectories, strict=True):
        usual, found = ((each.q - each.command).std(axis=0).mean() for each in (one, other))
        assert found > 1.2 * usual or one.name not in slow
