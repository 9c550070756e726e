"""A cause, judged on recordings that had no say in its size."""

import numpy as np

from shared.identification.catalogue.external_contact import EFFECT as PUSH
from shared.identification.catalogue.joint_spring import EFFECT as SPRING
from shared.identification.effect import Candidate
from shared.identification.fitting.fit import Fit, polish
from shared.identification.fitting.space import Space
from shared.identification.gate.left_out import LeftOut, left_out
from shared.identification.hidden.generator import simulated
from shared.identification.hidden.recipe import Recipe, Wish
from tests.measured import plain, problem_of


def judged(wish: Wish, candidate: Candidate, start: tuple[float, ...], train: int = 3) -> LeftOut:
    recipe = Recipe(
        arm="arm3", seed=5, wishes=(wish,), has_shares=False, seconds=3.0, train=train, test=1
    )
    # a spring is slow: it shows in residuals as they are
    problem = plain(problem_of(simulated(recipe)[0]))
    segments = problem.of("train")
    space = Space(problem)
    before = polish(space, np.zeros(space.size), segments, 4)
    grown = space.grown(candidate)
    after: Fit = polish(grown, np.r_[before.z, start], segments, 4)
    return left_out(before, after, candidate, segments)


def test_what_acts_in_every_recording_is_confirmed():
    found = judged(Wish("joint_spring", "elbow", 3.0), Candidate(SPRING, "elbow"), (0.0, 0.0))
    recordings = np.array_split(found.before - found.after, 3)
    assert sum(float(each.mean()) > 0.5 for each in recordings) >= 2
    assert found.after.mean() < 0.8 * found.before.mean()


def test_what_acted_in_one_recording_is_confirmed_by_none():
    push = Candidate(PUSH, "elbow in swings")
    found = judged(Wish("external_contact", "elbow in swings", 3.0), push, (1.0, 1.0, 0.5))
    assert found.after.mean() > 0.95 * found.before.mean()


def test_few_recordings_say_nothing_of_each_other():
    found = judged(
        Wish("joint_spring", "elbow", 3.0), Candidate(SPRING, "elbow"), (0.0, 0.0), train=2
    )
    assert not found.before.size
    assert not found.after.size
