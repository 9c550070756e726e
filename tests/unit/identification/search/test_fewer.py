"""What is taken back of several causes."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from shared.identification.catalogue.joint_spring import EFFECT as JOINT_SPRING
from shared.identification.dataset.types import Float64
from shared.identification.effect import Candidate
from shared.identification.fitting.fit import polish
from shared.identification.gate.certainty import half_widths, is_there
from shared.identification.gate.held_out import stretches
from shared.identification.search import fewer
from shared.identification.search.fewer import one_for_many, prune, tell_apart
from shared.identification.search.judging import Judged
from shared.identification.search.searched import Search
from shared.sim.plant.row import Row
from tests.searches import DRAG, ELBOW, LIFT, Searches

SPRING = Candidate(JOINT_SPRING, "elbow")


@pytest.fixture(scope="module")
def searches(tmp_path_factory: pytest.TempPathFactory) -> Searches:
    return Searches(tmp_path_factory.mktemp("data"))


def two_torques(searches: Searches, base: Float64, left: Float64) -> Search:
    """Return a search that took torques of two joints, and had tried a spring."""
    elbow, lift = (searches.tried(each, base, left) for each in (ELBOW, LIFT))
    spring = searches.tried(SPRING, np.full(8, 10.0), np.linspace(1.0, 1.2, 8), numbers=2)
    return searches.search(base, lift, before=(elbow,), tried=(spring,))


def test_one_cause_that_does_as_well_is_taken_for_two_of_one_effect(tmp_path: Path):
    def pull(row: Row) -> None:
        SPRING.effect.enter(row, SPRING.place, np.array([1.0, 0.3]))

    found = two_torques(
        Searches(tmp_path, enter=pull), np.linspace(8.0, 12.0, 4), np.linspace(0.95, 1.1, 4)
    )
    one_for_many(found, found.problem.of("train"), found.problem.of("test"))
    assert [each.candidate for each in found.accepted] == [SPRING]
    assert found.current.space.candidates == (SPRING,)
    assert found.rivals == [()]
    assert found.current_losses.mean() < 1.3


def test_what_was_taken_already_is_not_taken_for_others_as_well(searches: Searches):
    """Drag of the elbow would do for both torques, but it is there."""
    base, left = np.full(8, 10.0), np.linspace(1.0, 1.2, 8)
    drag, elbow, lift = (searches.tried(each, base, left) for each in (DRAG, ELBOW, LIFT))
    found = searches.search(base, lift, before=(drag, elbow), tried=(drag, elbow, lift))
    one_for_many(found, found.problem.of("train"), found.problem.of("test"))
    assert [each.candidate for each in found.accepted] == [DRAG, ELBOW, LIFT]


def a_tie_and_then_drag(searches: Searches) -> Search:
    """Return a search that took a torque of the elbow, no better than the lift's, and then drag."""
    bad, good = np.full(4, 9.0), np.full(4, 5.0)
    elbow, lift, drag = (searches.tried(each, bad, good) for each in (ELBOW, LIFT, DRAG))
    found = searches.search(bad, drag, before=(elbow,))
    found.rivals[0] = (lift,)
    train, test = found.problem.of("train"), found.problem.of("test")
    found.current = polish(found.current.space, found.current.z, train, 4)
    found.current_losses = stretches(found.problem, found.current.variant, test)
    return found


def test_of_what_was_not_told_apart_the_one_is_taken_that_does_better_beside_the_rest(
    tmp_path: Path,
):
    def pull(row: Row) -> None:
        LIFT.effect.enter(row, LIFT.place, np.array([1.0]))
        DRAG.effect.enter(row, DRAG.place, np.array([0.5]))

    found = a_tie_and_then_drag(Searches(tmp_path, enter=pull))
    before = found.current_losses.mean()
    tell_apart(found, found.problem.of("train"), found.problem.of("test"))
    assert [each.candidate for each in found.accepted] == [LIFT, DRAG]
    assert found.rivals == [(), ()]
    assert set(found.current.space.candidates) == {LIFT, DRAG}
    assert found.current_losses.mean() < 0.5 * before


def test_what_does_as_well_beside_the_rest_is_still_not_told_apart(searches: Searches):
    found = a_tie_and_then_drag(searches)
    current = found.current
    tell_apart(found, found.problem.of("train"), found.problem.of("test"))
    assert [each.candidate for each in found.accepted] == [ELBOW, DRAG]
    assert [each.candidate for each in found.rivals[0]] == [LIFT]
    assert found.current is current


def test_two_causes_of_one_effect_that_do_better_stay(searches: Searches):
    found = two_torques(searches, np.linspace(1.4, 1.6, 4), np.full(4, 0.01))
    one_for_many(found, found.problem.of("train"), found.problem.of("test"))
    assert [each.candidate for each in found.accepted] == [ELBOW, LIFT]


@pytest.mark.parametrize("widths", [0.0, 10.0])
def test_a_cause_that_may_as_well_be_nothing_is_taken_back(searches: Searches, widths: float):
    """However much it takes off the held-out loss: nothing is hidden in these recordings."""
    elbow = searches.tried(ELBOW, np.full(8, 10.0), np.linspace(1.0, 1.2, 8))
    found = searches.search(np.full(8, 10.0), elbow)
    train, test = found.problem.of("train"), found.problem.of("test")
    fit = polish(elbow.fit.space, elbow.fit.z, train, 4)
    z = fit.z.copy()
    z[-1] += widths * half_widths(fit, train)[-1]
    found.current = replace(fit, z=z)
    prune(found, train, test)
    if widths:
        assert [each.candidate for each in found.accepted] == [ELBOW]
    else:
        assert not found.accepted
        assert found.current is found.base
        assert found.current_losses is found.base_losses


@pytest.mark.parametrize("pulled", [0.0, 1.0])
def test_a_cause_without_which_the_rest_does_much_worse_stays(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, pulled: float
):
    """However seldom it is seen, as a drive's limit that one swing reaches."""

    def pull(row: Row) -> None:
        ELBOW.effect.enter(row, ELBOW.place, np.array([pulled]))
        LIFT.effect.enter(row, LIFT.place, np.array([1.0]))

    searches = Searches(tmp_path, seconds=4.0, enter=pull)
    bad, good = np.full(8, 10.0), np.linspace(1.0, 1.2, 8)
    elbow, lift = (searches.tried(each, bad, good) for each in (ELBOW, LIFT))
    found = searches.search(bad, lift, before=(elbow,))
    train, test = found.problem.of("train"), found.problem.of("test")
    found.current = polish(found.current.space, found.current.z, train, 4)
    found.current_losses = stretches(found.problem, found.current.variant, test)
    unsure = Judged(replace(elbow.gain, surely=-np.inf, apart=None), np.empty(0), None)
    monkeypatch.setattr(fewer, "judged", lambda *rest: unsure)
    monkeypatch.setattr(fewer, "_is_there", lambda *rest: True)
    prune(found, train, test)
    assert [each.candidate for each in found.accepted] == ([ELBOW, LIFT] if pulled else [LIFT])


def test_a_cause_that_is_surely_there_only_by_all_recordings_together_stays(tmp_path: Path):
    def pull(row: Row) -> None:
        ELBOW.effect.enter(row, ELBOW.place, np.array([0.3]))

    searches = Searches(tmp_path, seconds=4.0, enter=pull)
    elbow = searches.tried(ELBOW, np.full(8, 10.0), np.linspace(1.0, 1.2, 8))
    found = searches.search(np.full(8, 10.0), elbow)
    train, test = found.problem.of("train"), found.problem.of("test")
    fit = polish(elbow.fit.space, elbow.fit.z, train, 4)
    doubtful = fit.z.copy()
    doubtful[-1] = 0.5 * half_widths(fit, train)[-1]
    found.current = replace(fit, z=doubtful)
    assert not is_there(found.current, ELBOW, train)
    prune(found, train, test)
    assert [each.candidate for each in found.accepted] == [ELBOW]
