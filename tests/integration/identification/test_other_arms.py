"""Arms that share nothing with the project's own, by plain MuJoCo, with one thing wrong."""

from pathlib import Path

import numpy as np
import pytest

from shared.identification.dataset.reading import read_dataset
from shared.identification.dataset.types import Dataset
from shared.identification.find import identify
from studies.other_arms.arms import ARMS
from studies.other_arms.drawn import DRAWN, arm_named
from studies.other_arms.faults import ABSORBED, FAULTS
from studies.other_arms.recording import convert

SECONDS = 2.0
STEP = 0.0005
"""Ten times as long as that of a study (s)."""


@pytest.fixture(scope="module")
def right(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Dataset]:
    """Return what is recorded where nothing is wrong, by arm."""
    folder = tmp_path_factory.mktemp("right")
    return {arm: made(folder / arm, arm, "none") for arm in ARMS}


def made(folder: Path, arm: str, fault: str, seed: int = 3) -> Dataset:
    convert(folder / fault, ARMS[arm], fault, SECONDS, seed, STEP)
    return read_dataset(folder / fault)


@pytest.mark.parametrize("arm", ARMS)
def test_an_arm_is_recorded_with_a_repeat_and_held_out_motion(right: dict[str, Dataset], arm: str):
    dataset = right[arm]
    assert dataset.joints == ARMS[arm].joints
    assert dataset.control == ARMS[arm].control
    splits = [each.split for each in dataset.trajectories]
    assert (splits.count("train"), splits.count("test")) == (4, 2)
    slow, again = dataset.trajectories[:2]
    assert again.repeats == slow.name
    off = np.abs(again.q - slow.q).mean(axis=0)
    moved = np.ptp(slow.q, axis=0)
    assert np.all(off < 0.02 * moved)
    assert np.all(off > 0.0)


@pytest.mark.parametrize("name", DRAWN)
def test_an_arm_that_is_drawn_goes_where_it_is_sent(tmp_path: Path, name: str):
    arm = arm_named(name, 4)
    assert arm_named(name, 5).joints != arm.joints or arm_named(name, 5).limit[0] != arm.limit[0]
    convert(tmp_path / "set", arm, "none", SECONDS, 4, STEP)
    dataset = read_dataset(tmp_path / "set")
    assert dataset.control == DRAWN[name]
    for each in dataset.trajectories:
        assert np.abs(each.q - arm.home).max() < 4.0 * arm.swing.max()
    slow = dataset.trajectories[0]
    if name == "hanging":
        assert np.abs(slow.q - slow.command).max() < 0.3


@pytest.mark.slow
@pytest.mark.timeout(600)
def test_what_a_long_time_step_is_late_by_is_no_delay(tmp_path: Path):
    convert(tmp_path / "set", arm_named("hanging", 1), "none", 8.0, 1)
    verdict = identify(read_dataset(tmp_path / "set"), seed=1).verdict
    assert (verdict.verdict, verdict.timestep) == ("none", 0.0005), verdict.sentence


@pytest.mark.slow
@pytest.mark.timeout(900)
def test_an_arm_under_torques_goes_by_what_it_does_not_by_how_parts_begin(tmp_path: Path):
    convert(tmp_path / "set", arm_named("hanging_torques", 1), "none", 8.0, 1)
    verdict = identify(read_dataset(tmp_path / "set"), seed=1).verdict
    assert (verdict.verdict, verdict.timestep) == ("none", 0.0005), verdict.sentence
    # What random torques make of a part beyond its start (ADR 0020).
    assert verdict.held_out.joints_mrad["noise_floor"] == pytest.approx(0.195, abs=0.03)


@pytest.mark.parametrize(
    ("arm", "fault"),
    [("scara", name) for name in FAULTS if name not in ("none", "weak")] + [("three", "weak")],
)
def test_what_is_wrong_moves_the_arm_otherwise(
    tmp_path: Path, right: dict[str, Dataset], arm: str, fault: str
):
    wrong = made(tmp_path, arm, fault)
    noise = ARMS[arm].noise
    off = [
        float(np.sqrt(np.mean((one.q - other.q) ** 2)))
        for one, other in zip(right[arm].trajectories, wrong.trajectories, strict=True)
    ]
    assert max(off) > 5.0 * noise


def test_a_weak_drive_of_a_servo_is_its_gain():
    assert ("position", "weak") in ABSORBED
