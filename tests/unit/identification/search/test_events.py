"""What happened once stands out of a recording, in all channels or in one."""

import copy
from dataclasses import replace

import numpy as np
import pytest

from shared.identification.catalogue.external_contact import EFFECT as PUSH
from shared.identification.catalogue.torque_bias import EFFECT as BIAS
from shared.identification.dataset.types import Float64
from shared.identification.effect import Candidate
from shared.identification.fitting.fit import Fit, polish
from shared.identification.fitting.space import Space
from shared.identification.gate.held_out import plain_channels
from shared.identification.noise.pushed import Pushed
from shared.identification.search.events import Usual, explains_event, is_one
from shared.sim.plant.row import Row
from tests.measured import measure, problem_of

_PUSH = Candidate(PUSH, "elbow in first")
_SIZE = np.array([0.2, 1.0, 0.5])
"""Torque (N m), begin and length (s)."""


def losses(worst: float = 1.0, channels: slice = slice(0, 1), stretches: slice = slice(7, 8)):
    """Return those of forty stretches of ten channels, some of which are off."""
    found = 1.0 + 0.1 * np.random.default_rng(0).standard_normal((40, 10))
    found[stretches, channels] = worst
    return found


def is_calm(found: Float64, is_one_enough: bool = True) -> bool:
    return float(Usual.of(found, is_one_enough).exceeded(found).max()) <= 1.0


def test_noise_is_calm():
    assert is_calm(losses())


def test_one_channel_that_is_far_off_once_is_enough():
    assert is_calm(losses(8.0))
    assert not is_calm(losses(12.0))


def test_where_one_channel_is_not_enough_it_takes_all():
    assert is_calm(losses(12.0), is_one_enough=False)
    assert not is_calm(losses(8.0, slice(0, 10)), is_one_enough=False)


def test_all_channels_together_need_less():
    assert is_calm(losses(5.0, slice(0, 10)))
    assert not is_calm(losses(8.0, slice(0, 10)))


def test_a_channel_that_is_always_off_is_calm():
    assert is_calm(losses(12.0, stretches=slice(0, 40)))


@pytest.fixture(scope="module")
def pushed(tmp_path_factory: pytest.TempPathFactory) -> Fit:
    """Return the nominal arm beside recordings in one of which an elbow was pushed once."""

    def enter(row: Row) -> None:
        PUSH.enter(row, _PUSH.place, _SIZE)

    folder = tmp_path_factory.mktemp("pushed")
    problem = problem_of(measure(folder, np.random.default_rng(0), enter, seconds=4.0))
    space = Space(problem)
    return polish(space, np.zeros(space.size), problem.of("train"), steps=0)


def beside(pushed: Fit, candidate: Candidate, size: Float64) -> Fit:
    """Return the same with a cause of about a size, in its units, one step nearer to its best."""
    space = pushed.space.grown(candidate)
    quantities = candidate.effect.quantities(space.problem.subject, candidate.place)
    start = np.r_[pushed.z, size / np.array([each.probe for each in quantities])]
    return polish(space, start, space.problem.of("train"), steps=1)


def is_explained(
    pushed: Fit, candidate: Candidate, size: Float64, is_one_enough: bool = True
) -> bool:
    """Return whether a cause of a size explains what stands out."""
    train = pushed.space.problem.of("train")
    before = plain_channels(pushed.space.problem, pushed.variant, train)
    assert before.mean(axis=1).max() < 6.0  # too little of all channels
    assert not is_calm(before)
    usual = Usual.of(before, is_one_enough)
    off = usual.exceeded(before)
    return explains_event(candidate, usual, off, beside(pushed, candidate, size), train)


def test_a_push_of_one_joint_stands_out_and_is_explained_by_itself(pushed: Fit):
    assert is_explained(pushed, _PUSH, _SIZE)
    assert not is_explained(pushed, _PUSH, _SIZE, is_one_enough=False)


def test_what_leaves_it_or_acts_all_the_time_does_not_explain_it(pushed: Fit):
    assert not is_explained(pushed, _PUSH, np.array([_SIZE[0], _SIZE[1] + 1.5, _SIZE[2]]))
    assert not is_explained(pushed, Candidate(BIAS, "elbow"), _SIZE[:1])


def pushed_at_random(fit: Fit, torque: float) -> Fit:
    """Return a fit whose elbow is pushed at random by a torque (N m), as repeats have shown."""
    problem = copy.copy(fit.space.problem)
    model = problem.subject.nominal.model
    share = torque / float(model.jnt_actfrcrange[model.joint("elbow").id, 1])
    problem.noise = replace(problem.noise, pushed=Pushed(reading=1e-4, push=share, time=0.2))
    return replace(fit, space=Space(problem, fit.space.candidates))


def test_what_random_torques_do_is_no_push(pushed: Fit):
    train, found = pushed.space.problem.of("train"), beside(pushed, _PUSH, _SIZE)
    assert is_one(_PUSH, found, train)
    assert is_one(_PUSH, pushed_at_random(found, _SIZE[0] / 10.0), train)
    assert not is_one(_PUSH, pushed_at_random(found, _SIZE[0] / 3.0), train)
