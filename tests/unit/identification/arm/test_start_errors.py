"""What a part is off by because its first state is."""

from dataclasses import replace

import numpy as np
import pytest

from shared.identification.arm.start_errors import Doubt, FreeStarts
from shared.identification.arm.subject import subject_of
from shared.identification.fitting.parameters import base_parameters
from shared.identification.fitting.problem import BLOCK, Problem, Variant
from shared.identification.hidden.generator import simulated
from shared.identification.hidden.recipe import Recipe
from shared.identification.noise.floor import noise_of
from shared.sim.plant.rollouts import as_it_is


@pytest.fixture(scope="module")
def problem() -> Problem:
    """An arm under torques whose residuals are without what first states may be off by."""
    dataset, _ = simulated(Recipe(arm="torque2", seconds=4.0, train=2, test=1, seed=5))
    subject = subject_of(dataset)
    noise = replace(noise_of(dataset, BLOCK, subject.starts, subject.nominal), memory=None)
    free = replace(noise, start_doubt=np.full((2, 2), 1e3))
    return Problem(subject, dataset, base_parameters(subject), free)


def elsewhere(problem: Problem, by: float) -> Problem:
    """Return the same with parts that begin elsewhere, and faster (rad, rad/s)."""
    other = replace(problem)
    other.segments = tuple(
        replace(
            each,
            recorded=replace(
                each.recorded,
                initial_q=each.recorded.initial_q + 0.1 * by,
                initial_qd=each.recorded.initial_qd - by,
            ),
        )
        for each in other.segments
    )
    return other


def test_a_first_state_that_is_off_leaves_residuals_as_they_are(problem: Problem):
    nominal, train = Variant(np.zeros(len(problem.parameters))), problem.of("train")
    plain = replace(problem, noise=replace(problem.noise, start_doubt=None))
    changed = [
        elsewhere(each, 0.01).vector([nominal], train) - each.vector([nominal], train)
        for each in (problem, plain)
    ]
    free, held = (float(np.sqrt(np.mean(each**2))) for each in changed)
    assert free < 0.05 * held
    assert held > 0.1


def test_residuals_keep_what_no_first_state_makes_up_for(problem: Problem):
    train = problem.of("train")
    nominal = Variant(np.zeros(len(problem.parameters)))
    stiffer = Variant(np.r_[0.5, np.zeros(len(problem.parameters) - 1)])
    before, after = problem.vector([nominal, stiffer], train)
    assert np.mean((after - before) ** 2) > 0.01
    assert np.mean(after**2) > np.mean(before**2)


def test_each_part_is_asked_for_once(problem: Problem, monkeypatch: pytest.MonkeyPatch):
    starts = FreeStarts(problem.subject.nominal, as_it_is)
    parts = [each.recorded for each in problem.segments[:2]]
    first = starts.of(parts)
    monkeypatch.setattr(problem.subject.nominal, "run", lambda work: [] if not work else 1 / 0)
    again = starts.of(parts[::-1])
    assert again[0] is first[1]
    assert again[1] is first[0]
    assert first[0].joints.shape[1:] == (2, 4)


def test_nothing_is_left_along_what_first_states_surely_lead_to():
    rng = np.random.default_rng(0)
    columns = 1e6 * rng.standard_normal((10, 2, 3))
    values = rng.standard_normal((10, 2))
    found = Doubt.of(np.concatenate([columns, columns[..., :1] - columns[..., 1:2]], axis=2))
    left = found.without(values)
    assert columns.reshape(20, 3).T @ left.ravel() / 1e6 == pytest.approx(np.zeros(3), abs=1e-4)
    assert found.without(left) == pytest.approx(left, abs=1e-5)


def test_noise_and_first_states_that_are_off_are_white_together():
    rng = np.random.default_rng(1)
    columns = rng.standard_normal((6, 2, 2)) * [0.3, 4.0]
    found = Doubt.of(columns)
    draws = [
        found.without(rng.standard_normal((6, 2)) + columns @ rng.standard_normal(2)).ravel()
        for _ in range(20_000)
    ]
    assert np.cov(np.array(draws).T) == pytest.approx(np.eye(12), abs=0.06)


def test_what_is_known_of_first_states_is_kept():
    values = np.arange(8.0).reshape(4, 2)
    assert Doubt.of(np.zeros((4, 2, 3))).without(values) == pytest.approx(values)


def test_blocks_that_do_not_count_have_no_say_in_it(problem: Problem):
    nominal, segment = Variant(np.zeros(len(problem.parameters))), problem.of("test")[0]
    pushed = replace(problem, uncounted={})
    plain = replace(problem, noise=replace(problem.noise, start_doubt=None))
    late = np.arange(problem.shape_of(segment)[0]) >= 9
    logged = pushed.segments[segment]
    at = np.minimum(np.maximum(logged.recorded.joints_at - 0.18, 0.0), 1.0)[:, None]
    pushed.segments = tuple(
        replace(each, q=each.q + at) if index == segment else each
        for index, each in enumerate(pushed.segments)
    )
    (smeared,) = pushed.plain(nominal, [segment])
    pushed.uncounted[segment] = late
    (found,) = pushed.plain(nominal, [segment])
    (own,) = plain.plain(nominal, [segment])
    before = np.sqrt(np.mean(own[~late] ** 2))
    assert np.sqrt(np.mean(found[~late] ** 2)) <= before
    assert np.sqrt(np.mean(smeared[~late] ** 2)) > 3.0 * before
    assert np.abs(found[late]).max() > np.abs(smeared).max() > 10.0
