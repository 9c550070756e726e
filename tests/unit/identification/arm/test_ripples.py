"""Ripples of a torque are seen in the recordings before anything is simulated."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from shared.identification.arm.subject import subject_of
from shared.identification.catalogue.cogging import EFFECT as COGGING
from shared.sim.plant.row import Row
from tests.measured import measure, nothing


@pytest.mark.parametrize(("place", "ripples"), [("pan", 30.0), ("elbow", 37.0)])
def test_the_number_of_ripples_is_what_is_tried(tmp_path: Path, place: str, ripples: float) -> None:
    def enter(row: Row) -> None:
        COGGING.enter(row, place, np.array([0.2, -0.2, ripples]))

    subject = subject_of(measure(tmp_path, np.random.default_rng(0), enter))
    (tried,) = COGGING.quantities(subject, place)[2].grid
    travel = float(subject.travel[subject.joints.index(place)])
    # near enough for waves that are out of step by less than a quarter at either end
    assert abs(tried - ripples) * travel / 2.0 < math.pi / 2.0


def test_a_strong_ripple_leaks_into_others_and_is_tried_alone(tmp_path: Path) -> None:
    def enter(row: Row) -> None:
        COGGING.enter(row, "elbow", np.array([2.0, -2.0, 37.0]))

    subject = subject_of(measure(tmp_path, np.random.default_rng(0), enter))
    (tried,) = COGGING.quantities(subject, "elbow")[2].grid
    assert tried == pytest.approx(37.0, abs=1.5)


def test_without_ripples_some_are_tried_all_the_same(tmp_path: Path) -> None:
    subject = subject_of(measure(tmp_path, np.random.default_rng(0), nothing, seconds=4.0))
    for place in subject.joints:
        ripples = COGGING.quantities(subject, place)[2]
        assert all(ripples.low <= each <= ripples.high for each in ripples.grid)


def test_a_joint_that_stood_still_has_no_ripples(tmp_path: Path) -> None:
    dataset = measure(tmp_path, np.random.default_rng(0), nothing, seconds=2.0)
    stood = tuple(
        replace(each, q=each.q * np.array([1.0, 0.0, 1.0])) for each in dataset.trajectories
    )
    subject = subject_of(replace(dataset, trajectories=stood))
    assert [len(each) for each in subject.ripples] == [2, 0, 3]
