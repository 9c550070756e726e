"""Fits to long recordings."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from shared.identification.fitting.base import fit_base
from shared.identification.fitting.fit import Fit, polish
from shared.identification.fitting.long import (
    polish_better,
    polish_by_parts,
    polish_on_some,
    some_of,
)
from shared.identification.fitting.problem import Problem
from shared.identification.fitting.space import Space
from tests.measured import measure, problem_of

SECONDS = 4.4


@pytest.fixture
def problem(tmp_path: Path) -> Problem:
    """Return two recordings to fit to, in four parts each."""
    measured = measure(tmp_path, np.random.default_rng(0), seconds=SECONDS)
    both = tuple(replace(each, split="train") for each in measured.trajectories)
    return problem_of(replace(measured, trajectories=both)).in_parts(1.0)


@pytest.fixture
def is_long(monkeypatch: pytest.MonkeyPatch) -> None:
    """Have so much motion be four times what shows enough."""
    for module in ("fitting.long", "arm.segments"):
        monkeypatch.setattr(f"shared.identification.{module}.ENOUGH_SECONDS", 2.0)


def test_a_fit_to_little_begins_with_all_of_it(problem: Problem):
    train = problem.of("train")
    assert some_of(problem, train) == train


@pytest.mark.usefixtures("is_long")
def test_a_fit_to_much_begins_with_a_part_of_each_recording(problem: Problem):
    train = problem.of("train")
    assert some_of(problem, train) == (train[0], train[5])


@pytest.mark.usefixtures("is_long")
def test_of_whole_recordings_none_is_left_out(problem: Problem):
    whole = replace(problem, window=None)
    train = whole.of("train")
    assert len(train) == 2
    assert some_of(whole, train) == train


@pytest.mark.usefixtures("is_long")
def test_a_fit_by_way_of_some_parts_ends_where_a_fit_to_all_of_them_does(
    problem: Problem, monkeypatch: pytest.MonkeyPatch
):
    space, train = Space(problem), problem.of("train")
    fits: list[tuple[tuple[int, ...], Fit]] = []

    def seen(space: Space, start: np.ndarray | Fit, segments: tuple[int, ...], steps: int) -> Fit:
        fits.append((segments, polish(space, start, segments, steps)))
        return fits[-1][1]

    monkeypatch.setattr("shared.identification.fitting.long.polish", seen)
    start = np.zeros(space.size)
    start[0] = 0.3
    found, direct = polish_by_parts(space, start, train, 8), polish(space, start, train, 8)
    assert [segments for segments, _ in fits] == [some_of(problem, train), train]
    assert found.cost == pytest.approx(direct.cost, rel=2e-3)
    near, some = polish_on_some(Fit.at(space, start, train, is_rough=True), train, 8)
    assert some == some_of(problem, train)
    assert near.cost == pytest.approx(fits[0][1].cost, rel=2e-3)
    assert len(near.residual) < len(found.residual)


@pytest.fixture
def whole(problem: Problem) -> Space:
    """Return what is fitted to whole recordings."""
    return Space(replace(problem, window=None))


@pytest.mark.usefixtures("is_long")
def test_of_several_starts_the_best_one_on_some_short_parts_is_followed_in_whole_recordings(
    problem: Problem, whole: Space, monkeypatch: pytest.MonkeyPatch
):
    train = whole.problem.of("train")
    bad = Fit.at(whole, np.full(whole.size, 1.0), train)
    asked: list[tuple[int, ...]] = []

    def seen(space: Space, start: np.ndarray, segments: tuple[int, ...], steps: int) -> Fit:
        asked.append(segments)
        return polish(space, start, segments, steps if len(asked) > 1 else 0)

    monkeypatch.setattr("shared.identification.fitting.long.polish", seen)
    starts = [np.full(whole.size, off) for off in (0.8, 0.05)]
    found = polish_better(bad, problem, starts, train, 8)
    some = some_of(problem, problem.of("train"))
    assert asked == [some, some, some, train]
    assert found.cost == pytest.approx(polish(whole, starts[1], train, 8).cost, rel=2e-3)


@pytest.mark.usefixtures("is_long")
def test_a_fit_is_kept_if_no_start_leads_further_down_on_some_short_parts(
    problem: Problem, whole: Space, monkeypatch: pytest.MonkeyPatch
):
    train = whole.problem.of("train")
    good = polish(whole, np.zeros(whole.size), train, 8)
    asked: list[tuple[int, ...]] = []

    def seen(space: Space, start: np.ndarray, segments: tuple[int, ...], steps: int) -> Fit:
        asked.append(segments)
        return polish(space, start, segments, steps)

    monkeypatch.setattr("shared.identification.fitting.long.polish", seen)
    assert polish_better(good, problem, [np.full(whole.size, 0.05)], train, 8) is good
    assert train not in asked


def test_of_short_recordings_each_start_is_followed_in_whole_ones(problem: Problem, whole: Space):
    train = whole.problem.of("train")
    starts = [np.full(whole.size, off) for off in (0.3, 0.05)]
    costs = [polish_by_parts(whole, start, train, 8).cost for start in starts]
    bad = Fit.at(whole, np.full(whole.size, 1.0), train)
    assert polish_better(bad, problem, starts, train, 8).cost == min(costs) < bad.cost
    good = replace(bad, cost=0.5 * min(costs))
    assert polish_better(good, problem, starts, train, 8) is good


@pytest.mark.usefixtures("is_long")
def test_the_base_of_long_recordings_ends_where_that_of_short_ones_does(
    problem: Problem, monkeypatch: pytest.MonkeyPatch
):
    space = Space(replace(problem, window=None))
    by_some = fit_base(space, np.random.default_rng(0))
    monkeypatch.setattr("shared.identification.fitting.long.ENOUGH_SECONDS", 15.0)
    direct = fit_base(space, np.random.default_rng(0))
    assert by_some.whole.starts_agree == direct.whole.starts_agree
    assert by_some.whole.cost == pytest.approx(direct.whole.cost, rel=2e-3)
    assert by_some.parts.cost == pytest.approx(direct.parts.cost, rel=0.02)
    assert by_some.whole.space.problem is space.problem
    assert len(by_some.parts.residual) == len(direct.parts.residual)
