"""Which residuals are one piece of evidence."""

from dataclasses import replace

import numpy as np
import pytest

from shared.identification.fitting.problem import Problem
from shared.identification.gate.clusters import by_channel, by_stretch
from shared.identification.gate.held_out import STRETCH
from tests.measured import measure, problem_of


@pytest.fixture(scope="module")
def problem(tmp_path_factory: pytest.TempPathFactory) -> Problem:
    rng = np.random.default_rng(0)
    return problem_of(measure(tmp_path_factory.mktemp("data"), rng, seconds=2.0))


def test_every_residual_is_in_one_cluster_of_each_kind(problem: Problem):
    train = problem.of("train")
    count = sum(map(problem.size_of, train))
    for clusters in (by_stretch(problem, train), by_channel(problem, train)):
        assert sorted(np.concatenate(clusters)) == list(range(count))


def test_a_stretch_is_short_and_has_all_channels(problem: Problem):
    train = problem.of("train")
    channels = problem.shape_of(train[0])[1]
    clusters = by_stretch(problem, train)
    assert len(clusters) == len(train) * 2.0 / STRETCH
    for each in clusters:
        assert np.array_equal(each, np.arange(each[0], each[-1] + 1))
        assert len(each) % channels == 0


def test_a_channel_is_as_long_as_its_recording_whatever_parts_that_comes_in(problem: Problem):
    train = problem.of("train")
    rows, channels = problem.shape_of(train[0])
    clusters = by_channel(problem, train)
    assert len(clusters) == len(train) * channels
    assert all(len(each) == rows and set(np.diff(each)) == {channels} for each in clusters)
    parts = problem.in_parts(0.5)
    pieces = parts.of("train")
    assert len(pieces) == 4 * len(train)
    assert len(by_channel(parts, pieces)) == len(clusters)


def test_without_a_tracker_nothing_drifts(problem: Problem):
    still = replace(problem, noise=replace(problem.noise, tracker=None))
    assert by_channel(still, still.of("train")) == []
