"""Data sets made with the small arm of ``tests.arms``, for the tests of identification."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from shared.identification.arm.subject import recorded_of, subject_of
from shared.identification.dataset.types import Dataset, Float64, ModelSource, Trajectory
from shared.identification.fitting.parameters import base_parameters
from shared.identification.fitting.problem import BLOCK, Problem, Variant
from shared.identification.noise.floor import noise_of
from shared.sim.plant.rollouts import Rollouts
from shared.sim.plant.row import Row
from shared.sim.plant.structure import Structure
from tests.arms import JOINTS, write_arm

JOINT_NOISE = 3e-4
"""Of a reading (rad)."""
TRACKER_NOISE = 5e-4
"""Of a reading (m, and half of it in rad times 2)."""
Enter = Callable[[Row], None]


def swings(seconds: float, phase: float) -> Float64:
    """Return commands every 10 ms: three joints at frequencies of their own."""
    at = np.arange(0.0, seconds, 0.01)
    hertz = np.array([0.31, 0.43, 0.53])
    return 0.5 * np.sin(2.0 * np.pi * hertz * at[:, None] + phase) - 0.5 * np.sin(phase)


def nothing(row: Row) -> None:
    """Change nothing."""


def measure(
    folder: Path, rng: np.random.Generator, enter: Enter = nothing, structure: Structure = (),
    seconds: float = 8.0, again_from: Float64 | None = None,
) -> Dataset:  # fmt: skip
    """Return three recordings of an arm with something in it; the last repeats the first.

    Their names are ``first``, ``second`` (held out) and ``again``, which may start elsewhere.
    """
    at = np.arange(0.0, seconds, 0.01)
    empty = Trajectory(
        name="first", split="train", repeats="", initial_q=np.zeros(3), initial_qd=np.zeros(3),
        command_at=at, command=swings(seconds, 0.0), joints_at=at, q=np.zeros((len(at), 3)),
        tracker_at=at, tracker=np.tile([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0], (len(at), 1)),
    )  # fmt: skip
    blank = Dataset(
        folder=folder,
        source=ModelSource("mjcf", write_arm(folder), tracked="tool"),
        control="position",
        joints=JOINTS,
        actuators=JOINTS,
        trajectories=(
            empty,
            replace(empty, name="second", split="test", command=swings(seconds, 1.0)),
            replace(
                empty,
                name="again",
                repeats="first",
                initial_q=np.zeros(3) if again_from is None else again_from,
            ),
        ),
        caveats=(),
        hash="",
    )
    arms = Rollouts(subject_of(blank).plant, structure, 3)
    found = arms.run([(enter, each) for each in recorded_of(blank)])
    measured: list[Trajectory] = []
    for trajectory, reports in zip(blank.trajectories, found, strict=True):
        assert reports.tracker is not None
        pose = reports.tracker.copy()
        pose[:, :3] += TRACKER_NOISE * rng.standard_normal((len(at), 3))
        pose[:, 4:] += 0.5 * TRACKER_NOISE * rng.standard_normal((len(at), 3))
        pose[:, 3:] /= np.linalg.norm(pose[:, 3:], axis=1, keepdims=True)
        q = reports.q + JOINT_NOISE * rng.standard_normal(reports.q.shape)
        measured.append(replace(trajectory, q=q, tracker=pose))
    return replace(blank, trajectories=tuple(measured))


def problem_of(dataset: Dataset) -> Problem:
    """Return the data against the nominal arm."""
    subject = subject_of(dataset)
    return Problem(subject, dataset, base_parameters(subject), noise_of(dataset, BLOCK, {}))


def plain(problem: Problem) -> Problem:
    """Return a problem as if nothing were known of what noise carries on: residuals as they are."""
    noise = replace(problem.noise, memory=None)
    return Problem(problem.subject, problem.dataset, problem.parameters, noise)


def nominal(problem: Problem) -> Variant:
    """Return the arm as its model file has it."""
    return Variant(np.zeros(len(problem.parameters)))
