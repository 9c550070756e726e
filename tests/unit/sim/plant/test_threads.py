"""What is simulated does not depend on how many threads do it."""

from pathlib import Path

import numpy as np
import pytest

from shared.identification.arm.subject import recorded_of, subject_of
from shared.identification.catalogue.load_friction import EFFECT as LOADED
from shared.identification.fitting.parameters import base_parameters
from shared.identification.fitting.problem import BLOCK, Problem, Variant
from shared.identification.noise.floor import noise_of
from shared.sim.plant.rollouts import Entry, Rollouts
from shared.sim.plant.row import Row
from tests.measured import measure, nothing


def heavier(row: Row) -> None:
    row.field("body_mass")[:] *= 1.5


def loaded(row: Row) -> None:
    """Let a law act at every step."""
    LOADED.enter(row, "elbow", np.array([0.1, 1e-3]))


@pytest.mark.parametrize("entries", [(nothing, heavier), (nothing, heavier, loaded)])
def test_reports_do_not_depend_on_threads(tmp_path: Path, entries: tuple[Entry, ...]) -> None:
    dataset = measure(tmp_path, np.random.default_rng(0), seconds=1.0)
    work = [(entry, each) for entry in entries for each in recorded_of(dataset)]
    one, three = (
        Rollouts(subject_of(dataset).plant, (), len(work), threads).run(work) for threads in (1, 3)
    )
    for alone, together in zip(one, three, strict=True):
        np.testing.assert_array_equal(alone.q, together.q)
        np.testing.assert_array_equal(alone.tracker, together.tracker)


def test_arms_at_another_time_step_have_as_many_threads(tmp_path: Path) -> None:
    dataset = measure(tmp_path, np.random.default_rng(0), seconds=1.0)
    subject = subject_of(dataset, threads=3)
    noise = noise_of(dataset, BLOCK, subject.starts, subject.nominal)
    problem = Problem(subject, dataset, base_parameters(subject), noise)
    problem.reports([Variant(np.zeros(len(problem.parameters)))], [0], 0.001)
    arms = problem._arms.values()  # pyright: ignore[reportPrivateUsage]
    assert [each.threads for each in arms] == [3, 3]
