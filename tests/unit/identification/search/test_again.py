"""A second search does not count, or fit to, what something outside did to the recordings."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from shared.identification.fitting.problem import Span
from shared.identification.search.again import fresh, leave_out, pushed_in
from shared.identification.search.searched import Search
from shared.identification.verdict import Unexplained
from tests.searches import ELBOW, Searches

_MADE_UP = np.full(8, 3.0)
_PUSHED = slice(110, 140)
"""Readings, every 10 ms, of the recording that is held out."""


@pytest.fixture(scope="module")
def searches(tmp_path_factory: pytest.TempPathFactory) -> Searches:
    made = Searches(tmp_path_factory.mktemp("data"), seconds=4.0)
    (held_out,) = made.problem.of("test")
    made.problem.segments[held_out].q[_PUSHED] += 0.05  # rad
    return made


@pytest.fixture
def found(searches: Searches) -> Search:
    searches.problem.uncounted.clear()
    return searches.search(_MADE_UP)


def left(begin: float, end: float, trajectory: str = "second", is_external: bool = True):
    return Unexplained(
        where="elbow", trajectory=trajectory, begin=begin, end=end, phase="once", size=0.01,
        unit="rad", times_noise=9.0, is_external=is_external,
    )  # fmt: skip


def test_what_was_pushed_in_held_out_motion_counts_no_more(found: Search):
    assert leave_out(found, [left(1.1, 1.4)])
    (held_out,) = found.problem.of("test")
    assert (
        0.4 < 0.02 * found.problem.uncounted[held_out].sum() < 1.0
    )  # with what it is smeared over
    assert len(found.base_losses) == len(found.nominal_losses) == len(found.current_losses) == 6
    assert found.base_losses.max() < 2.0


def test_what_was_not_pushed_from_outside_or_was_fitted_to_counts(found: Search):
    assert not leave_out(found, [left(1.1, 1.4, is_external=False), left(1.1, 1.4, "first")])
    assert not found.problem.uncounted
    assert found.base_losses is _MADE_UP


def test_where_hardly_anything_would_be_left_all_of_it_counts(found: Search):
    assert not leave_out(found, [left(0.2, 2.5)])
    assert not found.problem.uncounted
    assert found.base_losses is _MADE_UP


def in_halves(searches: Searches) -> Search:
    """Return a search of which recordings are replayed in parts of half a second."""
    return replace(searches.search(_MADE_UP), problem=searches.problem.windowed(0.5))


def begins(found: Search, aside: Sequence[Span]) -> list[float]:
    """Return when the parts begin that are fitted to with something set aside (s)."""
    problem = replace(found.problem, aside=tuple(aside))
    return [problem.segments[index].recorded.begin for index in problem.of("train")]


def test_what_was_pushed_in_motion_to_fit_to_is_set_aside(searches: Searches):
    found = in_halves(searches)
    aside = pushed_in(found, [left(1.1, 1.4, "first"), left(1.1, 1.4)])
    assert Span("first", 1.1, 1.4) in aside
    kept, everything = begins(found, aside), begins(found, ())
    gone = [each for each in everything if each not in kept]
    assert gone
    assert all(each < 1.4 and each + 0.5 > 1.1 for each in gone)
    problem = replace(found.problem, aside=aside)
    assert problem.of("test") == found.problem.of("test")
    assert problem.windowed(0.25).aside == problem.freer(()).aside == aside


def test_nothing_is_set_aside_that_was_held_out_is_no_push_or_is_most_of_it(searches: Searches):
    found = in_halves(searches)
    assert pushed_in(found, [left(1.1, 1.4), left(1.1, 1.4, "first", is_external=False)]) == ()
    assert pushed_in(found, [left(0.2, 3.0, "first")]) == ()


def test_a_second_search_begins_as_the_first_did_whatever_that_finds(searches: Searches):
    tried = searches.tried(ELBOW, _MADE_UP, _MADE_UP / 3.0)
    first = searches.search(_MADE_UP)
    second = fresh(first, seed=4)
    first.accepted.append(tried)
    first.rivals.append(())
    first.tried[tried.candidate.label] = tried
    first.screened[tried.candidate.label] = tried.screened
    assert (second.screened, second.tried, second.accepted, second.rivals) == ({}, {}, [], [])
    assert second.problem is first.problem
    assert fresh(first, seed=4).rng.random() == second.rng.random()
