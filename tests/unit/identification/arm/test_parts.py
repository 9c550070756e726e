"""A PR2's recordings are replayed in parts, and compared with their repeats part by part."""

from pathlib import Path

import numpy as np
import pytest

from shared.identification.arm.segments import segments_of
from shared.identification.arm.subject import Subject, subject_of
from shared.identification.catalogue.thermal_derating import EFFECT as DERATING
from shared.identification.dataset.types import POSE, Dataset, Float64, ModelSource, Trajectory
from shared.identification.fitting.problem import BLOCK
from shared.identification.noise.floor import repeat_differences
from shared.sim.plant.kinematics import tool_poses
from shared.sim.plant.plant import pr2
from shared.sim.plant.replay import Recorded
from shared.sim.plant.rollouts import Rollouts
from shared.sim.plant.row import Row
from shared.sim.plant.signals import Signal

REST = np.array([-0.85, 0.30, -1.50, -1.45, 0.50, -1.00, 1.46])
NOISE = 2e-4
AT: Float64 = np.arange(0.0, 3.2, 0.01)


def same(_: Row) -> None:
    """Change nothing."""


@pytest.fixture(scope="module")
def dataset() -> Dataset:
    """A motion, and its repeat from another posture of the elbow."""
    rollouts = Rollouts(pr2("right", None), (), 2)
    q = REST + 0.2 * np.outer(1.0 - np.cos(np.pi * AT), np.linspace(1.0, 0.5, 7))
    command = tool_poses(rollouts.plant, rollouts.model, q)
    starts = [REST, REST + np.linspace(0.03, -0.03, 7)]
    found = rollouts.run(
        [
            (same, Recorded(each, np.zeros(7), Signal(AT, command), Signal(AT, q), AT, AT))
            for each in starts
        ]
    )
    rng = np.random.default_rng(0)
    made = tuple(
        Trajectory(
            name, "train", repeats, start, np.zeros(7), AT, command, AT,
            reports.q + NOISE * rng.standard_normal(q.shape), None, None, AT, reports.tracker,
        )
        for name, repeats, start, reports in zip(
            ("once", "again"), ("", "once"), starts, found, strict=True
        )
    )  # fmt: skip
    labels = rollouts.plant.labels
    return Dataset(Path(), ModelSource("pr2"), "pose", labels, POSE, made, (), "")


@pytest.fixture(scope="module")
def subject(dataset: Dataset) -> Subject:
    return subject_of(dataset)


def test_parts_of_a_second_begin_where_the_arm_was(dataset: Dataset, subject: Subject):
    segments = segments_of(dataset, subject)
    assert [each.trajectory for each in segments] == [0, 0, 0]
    assert np.diff([each.recorded.begin for each in segments]) == pytest.approx([1.0, 1.0])
    found = subject.nominal.run([(same, each.recorded) for each in segments])
    for reports, each in zip(found, segments, strict=True):
        assert each.tracker is not None
        assert float(np.abs(reports.q - each.q).max()) < 30.0 * NOISE
        assert float(np.abs(reports.q - each.q)[:3].max()) < 5.0 * NOISE


def test_where_a_repeat_was_elsewhere_is_no_noise(dataset: Dataset, subject: Subject):
    (raw,) = repeat_differences(dataset, BLOCK, {})
    (corrected,) = repeat_differences(dataset, BLOCK, subject.starts)
    assert np.abs(raw.joints).max() > 50.0 * NOISE
    assert float(np.sqrt(np.mean(corrected.joints**2))) < 8.0 * NOISE


def test_a_part_begins_as_warm_as_the_motion_before_made_it(dataset: Dataset, subject: Subject):
    joint = subject.joints[0]
    heats: list[float] = []
    for each in segments_of(dataset, subject):

        def enter(row: Row) -> None:
            DERATING.enter(row, joint, np.array([0.01]))

        (_, values), *_ = subject.nominal.entered(enter, each.recorded).laws
        heats.append(float(values[7]))
    assert heats[0] < 0.2 * heats[1] < 0.2 * heats[2]
