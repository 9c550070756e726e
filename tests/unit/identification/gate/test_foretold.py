"""What was held out, asked whether it goes as a cause says."""

import functools
from dataclasses import replace

import numpy as np
import pytest

from shared.identification.catalogue.coulomb_friction import EFFECT as COULOMB
from shared.identification.catalogue.inertia_error import EFFECT as INERTIA
from shared.identification.catalogue.load_friction import EFFECT as LOAD
from shared.identification.effect import Candidate
from shared.identification.fitting.fit import Fit, polish
from shared.identification.fitting.space import Space
from shared.identification.gate.foretold import (
    Foretold,
    Held,
    _slow,  # pyright: ignore[reportPrivateUsage]
)
from shared.identification.gate.held_out import compare, stretches
from shared.identification.hidden.generator import simulated
from shared.identification.hidden.recipe import Recipe, wish_of
from tests.measured import problem_of

SHOULDER, ELBOW = Candidate(LOAD, "shoulder"), Candidate(LOAD, "elbow")


class Looked:
    """A small arm with a cause so small that the held-out loss hardly shows it."""

    def __init__(self, wish: str) -> None:
        recipe = Recipe(
            arm="arm3", seed=7, wishes=(wish_of(wish),) if wish else (), has_shares=False,
            seconds=3.0, train=2, test=2,
        )  # fmt: skip
        self.problem = problem_of(simulated(recipe)[0])
        space = Space(self.problem)
        self.before = polish(space, np.zeros(space.size), self.problem.of("train"), 4)
        self.held = Held(self.before)

    @functools.cache  # noqa: B019
    def after(self, candidate: Candidate) -> Fit:
        grown = self.before.space.grown(candidate)
        return polish(grown, np.r_[self.before.z, 0.5, 1.0], self.problem.of("train"), 4)

    def follow(self, candidate: Candidate) -> Foretold:
        return self.held.follow(self.before.variant, self.after(candidate).variant)


@pytest.fixture(scope="module")
def small() -> Looked:
    return Looked("load_friction@shoulder=0.06")


def test_what_is_held_out_follows_the_right_cause_where_its_loss_says_little(small: Looked):
    after, test = small.after(SHOULDER), small.problem.of("test")
    losses = [stretches(small.problem, fit.variant, test) for fit in (small.before, after)]
    gain = compare(losses[0], losses[1], np.random.default_rng(0))
    found = small.held.follow(small.before.variant, after.variant)
    assert found.is_seen
    assert found.share == pytest.approx(1.0, abs=0.5)
    assert found.errors > 1.3 * gain.gain / gain.error


def test_it_does_not_follow_another_cause_nor_one_that_is_not_there(small: Looked):
    assert not small.follow(ELBOW).is_seen
    nothing = Looked("")
    assert not nothing.follow(SHOULDER).is_seen
    assert not nothing.follow(ELBOW).is_seen


def test_what_the_base_could_make_up_for_is_no_evidence(small: Looked):
    """A base that is better fitted takes off some loss, and nothing in favour of a cause."""
    worse = replace(small.before, z=small.before.z + 0.01)
    found = small.held.follow(worse.variant, small.before.variant)
    assert abs(found.errors) < 0.3 * np.sqrt(len(small.before.z))


def test_a_cause_that_changes_nothing_is_not_followed(small: Looked):
    grown = small.before.space.grown(Candidate(COULOMB, "elbow"))
    same = replace(small.before, space=grown, z=np.r_[small.before.z, 0.0])
    assert small.held.follow(small.before.variant, same.variant) == Foretold(0.0, 0.0, 0.0)


def test_stretches_that_do_not_count_have_no_say(small: Looked):
    test = small.problem.of("test")
    for segment in test:
        small.problem.uncounted[segment] = np.ones(small.problem.shape_of(segment)[0], np.bool_)
        small.problem.uncounted[segment][:40] = False
    try:
        found = Held(small.before).follow(small.before.variant, small.after(SHOULDER).variant)
    finally:
        small.problem.uncounted.clear()
    assert found.errors < small.follow(SHOULDER).errors


@pytest.mark.parametrize(
    ("errors", "share", "is_seen"),
    [(3.0, 0.9, True), (1.0, 0.9, False), (5.0, 0.2, False), (-5.0, -0.9, False)],
)
def test_it_is_seen_if_it_is_beyond_chance_and_about_as_much_as_foretold(
    errors: float, share: float, is_seen: bool
):
    assert Foretold(errors, share).is_seen == is_seen


def test_what_it_takes_off_is_told_stretch_by_stretch_without_what_the_base_could_do(small: Looked):
    found = small.follow(SHOULDER)
    assert len(found.before) == len(found.after) == 10
    assert found.before.mean() > found.after.mean()
    worse = replace(small.before, z=small.before.z + 0.01)
    bent = small.held.follow(worse.variant, small.after(SHOULDER).variant)
    assert bent.before.mean() == pytest.approx(found.before.mean(), rel=0.02)


def test_a_link_that_is_heavier_than_its_file_is_not_refuted_by_what_leaves_links_out(
    small: Looked,
):
    grown = small.before.space.grown(Candidate(INERTIA, "shoulder"))
    heavier = grown.variant(np.r_[small.before.z, 1.0])
    found = small.held.follow(small.before.variant, heavier)
    assert not found.is_seen
    assert found.kept < 0.1 < small.follow(SHOULDER).kept
    assert not found.is_refuted
    assert replace(found, kept=0.5).is_refuted


def test_what_drifts_for_seconds_is_less_evidence_than_what_comes_and_goes():
    rng = np.random.default_rng(3)
    white = rng.standard_normal(4000)
    slow = np.convolve(white, np.ones(8) / np.sqrt(8.0), mode="same")
    assert _slow(white) == pytest.approx(float(white @ white), rel=0.15)
    assert _slow(slow) > 2.5 * float(slow @ slow)
