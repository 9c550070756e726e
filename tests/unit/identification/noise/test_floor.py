"""The noise floor from repeats, against noise of known size."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from shared.identification.arm.parts import CUTS
from shared.identification.arm.subject import subject_of
from shared.identification.dataset.types import Dataset, Float64, ModelSource, Trajectory
from shared.identification.fitting.problem import BLOCK, Problem
from shared.identification.hidden.generator import simulated
from shared.identification.hidden.recipe import Recipe
from shared.identification.noise.blocks import block_means
from shared.identification.noise.drift import Drift
from shared.identification.noise.floor import noise_of, repeat_differences

AT = 0.02 * np.arange(400.0)
"""A reading a block, 8 s."""


def autoregressive(rng: np.random.Generator, correlation: float, columns: int) -> Float64:
    """Return noise of variance 1 whose neighbours correlate: float64[400, columns]."""
    fresh = rng.standard_normal((len(AT), columns))
    out = fresh.copy()
    for index in range(1, len(AT)):
        out[index] = correlation * out[index - 1] + np.sqrt(1 - correlation**2) * fresh[index]
    return out


def repeated(first: Float64, second: Float64 | None) -> Dataset:
    """Return two recordings of the same commands, or one."""
    still = np.zeros(first.shape[1])
    one = Trajectory(
        "one", "train", "", still, still, AT, np.zeros_like(first), AT, first + np.sin(AT)[:, None]
    )
    found = (one,)
    if second is not None:
        again = replace(one, name="again", repeats="one", q=second + np.sin(AT)[:, None])
        found = (one, again)
    names = tuple(f"joint {index}" for index in range(first.shape[1]))
    return Dataset(Path(), ModelSource("mjcf"), "position", names, names, found, (), "")


@pytest.mark.parametrize(("correlation", "tolerance"), [(0.0, 0.02), (0.6, 0.03), (0.9, 0.06)])
def test_the_floor_of_correlated_noise_is_found_from_one_repeat(
    correlation: float, tolerance: float
):
    rng = np.random.default_rng(3)
    first, second = (0.01 * autoregressive(rng, correlation, 100) for _ in range(2))
    found = noise_of(repeated(first, second), 0.02, {})
    assert found.is_measured
    assert np.sqrt(np.mean(found.joints**2)) == pytest.approx(0.01, rel=tolerance)
    # Leaving out the noisiest stretches leaves out some of what correlates most.
    assert correlation - 0.06 < found.correlation.mean() < correlation + 0.03


@pytest.mark.parametrize("correlation", [0.0, 0.6, 0.9])
def test_what_is_new_in_a_block_is_white_noise_of_variance_one(correlation: float):
    rng = np.random.default_rng(8)
    first, second = (0.01 * autoregressive(rng, correlation, 40) for _ in range(2))
    found = noise_of(repeated(first, second), 0.02, {})
    fresh = found.news(autoregressive(rng, correlation, 40))
    assert np.mean(fresh**2) == pytest.approx(1.0, rel=0.1)
    assert np.mean(fresh[1:] * fresh[:-1]) == pytest.approx(0.0, abs=0.08)


def test_without_repeats_nothing_is_known_to_be_carried_on():
    noise = autoregressive(np.random.default_rng(9), 0.9, 5)
    found = noise_of(repeated(noise, None), 0.02, {})
    assert found.memory is None
    assert found.news(noise) is noise


def test_a_stretch_in_which_repeats_part_company_does_not_raise_the_floor():
    rng = np.random.default_rng(4)
    first, second = (autoregressive(rng, 0.0, 50) for _ in range(2))
    second[100:125] += 20.0 * np.sin(np.linspace(0.0, np.pi, 25))[:, None]
    found = noise_of(repeated(first, second), 0.02, {})
    assert np.sqrt(np.mean(found.joints**2)) == pytest.approx(1.0, rel=0.05)
    assert found.correlation.mean() < 0.1


def test_a_repeat_that_ends_early_is_compared_as_far_as_it_goes():
    rng = np.random.default_rng(5)
    dataset = repeated(*(0.001 * autoregressive(rng, 0.0, 20) for _ in range(2)))
    one, again = dataset.trajectories
    poses = np.concatenate([one.q[:, :3], np.tile([1.0, 0.0, 0.0, 0.0], (len(AT), 1))], axis=1)
    others = np.concatenate([again.q[:, :3], poses[:, 3:]], axis=1)
    pair = (
        replace(one, tracker_at=AT, tracker=poses),
        replace(again, joints_at=AT[:200], q=again.q[:200],
                tracker_at=AT[:200], tracker=others[:200]),
    )  # fmt: skip
    found = noise_of(replace(dataset, trajectories=pair), 0.02, {})
    assert found.tracker is not None
    assert np.sqrt(np.mean(found.joints**2)) == pytest.approx(0.001, rel=0.05)
    assert np.sqrt(np.mean(found.tracker[:3] ** 2)) == pytest.approx(0.001, rel=0.1)


def test_without_repeats_what_is_faster_than_the_arm_is_the_noise():
    noise = 0.001 * autoregressive(np.random.default_rng(6), 0.0, 50)
    found = noise_of(repeated(noise, None), 0.02, {})
    assert not found.is_measured
    assert np.sqrt(np.mean(found.joints**2)) == pytest.approx(0.001, rel=0.1)


def test_block_means_are_those_by_hand_and_a_block_without_a_reading_is_left_out():
    at = np.array([1.0, 1.01, 1.02, 1.03, 1.07])
    values = np.array([[1.0], [3.0], [5.0], [9.0], [4.0]])
    assert block_means(at, values, 0.02).tolist() == [[2.0], [7.0], [4.0]]
    assert block_means(at, values[:3], 0.02).tolist() == [[2.0], [5.0]]


def test_a_floor_is_never_under_what_an_encoders_steps_hide():
    rng = np.random.default_rng(6)
    held = np.repeat(rng.integers(-3, 4, (20, 2)), 20, axis=0) * 0.01
    swung = repeated(held, held)
    assert noise_of(swung, 0.02, {}).joints.max() < 0.01  # the sine that was added has no steps
    still = replace(swung, trajectories=tuple(replace(each, q=held) for each in swung.trajectories))
    assert noise_of(still, 0.02, {}).joints == pytest.approx(0.01 / np.sqrt(12.0))


def test_repeats_are_compared_in_the_blocks_that_residuals_of_parts_have():
    dataset, _ = simulated(Recipe(arm="torque2", seconds=6.0, train=2, test=1, seed=5))
    subject = subject_of(dataset)
    pair, *_ = repeat_differences(dataset, BLOCK, subject.starts, CUTS["torque"])
    problem = Problem(subject, dataset, (), noise_of(dataset, BLOCK, subject.starts))
    repeated_one = next(each.repeats for each in dataset.trajectories if each.repeats)
    names = [each.name for each in dataset.trajectories]
    own = [
        index
        for index, each in enumerate(problem.segments)
        if names[each.trajectory] == repeated_one
    ]
    where = [problem.positions(each) for each in own]
    assert np.bincount(pair.joints_parts).tolist() == [len(each) for each in where]
    assert pair.q == pytest.approx(np.concatenate(where), abs=1e-12)


def test_noise_grows_under_torques_from_free_starts_where_commands_answer_it():
    dataset, _ = simulated(Recipe(arm="torque2", seconds=6.0, train=2, test=1, seed=5))
    subject = subject_of(dataset)
    open_loop = noise_of(dataset, BLOCK, subject.starts, subject.nominal)
    assert isinstance(open_loop.memory, Drift)
    grown = open_loop.memory.spread(15)
    assert np.mean(grown**2, axis=0) == pytest.approx(np.ones(grown.shape[1]), rel=0.2)
    rng = np.random.default_rng(0)
    answered = tuple(
        replace(each, command=each.command + 0.02 * rng.standard_normal(each.command.shape))
        if each.repeats
        else each
        for each in dataset.trajectories
    )
    closed = replace(dataset, trajectories=answered)
    subject = subject_of(closed)
    noise = noise_of(closed, BLOCK, subject.starts, subject.nominal)
    assert noise.is_measured
    assert noise.has_free_starts
    assert not open_loop.has_free_starts
    assert isinstance(noise.memory, Drift)
    assert not noise.memory.kinds[:, 1:3].any()
    assert np.all(noise.memory.spread(15)[0, :2] < 0.2)
