"""What speaks for a cause."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from shared.identification.fitting.fit import Fit
from shared.identification.gate.foretold import Foretold
from shared.identification.search import judging
from shared.identification.search.judging import foretells, judged
from shared.identification.search.searched import Model, is_open
from tests.searches import ELBOW, Searches

_USUAL = 1.0 + 0.2 * np.sin(np.arange(22.0))
_EVENT = _USUAL + np.where(np.arange(22) == 7, 10.0, 0.0) + np.where(np.arange(22) == 8, 15.0, 0.0)


def _fitted(searches: Searches) -> Fit:
    """Return a fit that explains what it was fitted to better than the base does."""
    fit = searches.tried(ELBOW, _USUAL, _USUAL).fit
    return replace(fit, cost=0.9 * searches.base.cost)


@pytest.mark.parametrize(
    ("before", "after", "told"),
    [
        (_EVENT, _USUAL, True),
        (_EVENT, np.where(np.arange(22) == 8, 7.0, _USUAL), False),  # something still stands out
        (_EVENT, np.where(np.arange(22) == 3, 9.0, _USUAL), False),  # elsewhere, now
        (_USUAL + 2.0, _USUAL, False),  # nothing stood out
        (_EVENT, np.minimum(_EVENT, 5.9), False),  # half of it is no explanation
    ],
)
def test_a_cause_foretells_an_event_if_nothing_of_it_is_left(before, after, told: bool):
    assert foretells(before, after) is told


def test_an_event_that_a_cause_foretells_makes_it_sure(tmp_path):
    searches = Searches(tmp_path)
    found = searches.search(_EVENT)
    before = Model(searches.base, _EVENT)
    fit = _fitted(searches)
    assert judged(found, ELBOW, before, Model(fit, _USUAL)).gain.is_sure
    some = np.where(np.arange(22) == 8, 7.0, _USUAL)
    assert not judged(found, ELBOW, before, Model(fit, some)).gain.is_sure


def test_what_explains_the_recordings_that_were_fitted_to_worse_is_not_sure(tmp_path):
    searches = Searches(tmp_path)
    found = searches.search(_USUAL + 2.0)
    before = Model(searches.base, _USUAL + 2.0)
    fit = _fitted(searches)
    assert judged(found, ELBOW, before, Model(fit, _USUAL)).gain.is_sure
    worse = replace(fit, cost=searches.base.cost + 1.0)
    assert not judged(found, ELBOW, before, Model(worse, _USUAL)).gain.is_sure


@pytest.mark.parametrize(
    ("fitted", "errors", "share", "kept", "is_followed", "is_sure"),
    [
        (2.7, 3.0, 0.8, 1.0, True, True),
        (3.8, 1.8, 0.8, 1.0, True, True),  # surer by what was fitted to, and the other way round
        (1.0, 4.6, 0.8, 1.0, True, True),
        (2.7, 2.6, 0.8, 1.0, False, True),  # then the loss itself has to say so
        (9.0, 1.0, 0.8, 1.0, False, False),  # what goes there the base could do as well
        (9.0, 1.0, 0.8, 0.05, False, True),  # it is a link that weighs more: that does not show
        (9.0, 9.0, 0.2, 1.0, False, False),
        (9.0, 9.0, 0.8, 0.05, False, True),  # nearly all of it links could do: that says nothing
    ],
)
def test_a_cause_is_followed_by_what_was_fitted_to_and_what_was_held_out_together(
    tmp_path, monkeypatch, fitted: float, errors: float, share: float, kept: float,
    is_followed: bool, is_sure: bool,
):  # fmt: skip
    searches = Searches(tmp_path)
    found = searches.search(_USUAL + 2.0)
    told = Foretold(errors, share, kept, _USUAL + 0.5, _USUAL)
    monkeypatch.setattr(judging, "_foretold", lambda *rest: told)
    monkeypatch.setattr(judging, "sureness", lambda *rest: fitted)
    fit = _fitted(searches)
    gain, _, foretold = judged(
        found, ELBOW, Model(searches.base, _USUAL + 2.0), Model(fit, _USUAL)
    )  # fmt: skip
    assert foretold is told
    assert (gain.apart is not None) == is_followed
    assert gain.apart is None or gain.apart.gain == pytest.approx(0.5)
    assert gain.is_sure == is_sure


@pytest.mark.parametrize(
    ("left", "is_followed"),
    [
        (_USUAL + 0.1 * np.sin(2.0 * np.arange(22.0)), True),  # as much as before
        (_USUAL + 0.1, False),  # more in every stretch
    ],
)
def test_what_makes_all_that_was_held_out_surely_worse_is_not_followed(
    tmp_path, monkeypatch, left, is_followed: bool
):
    searches = Searches(tmp_path)
    found = searches.search(_USUAL)
    told = Foretold(9.0, 0.8, 1.0, _USUAL + 0.5, _USUAL)
    monkeypatch.setattr(judging, "_foretold", lambda *rest: told)
    monkeypatch.setattr(judging, "sureness", lambda *rest: 9.0)
    after = Model(_fitted(searches), left)
    gain = judged(found, ELBOW, Model(searches.base, _USUAL), after).gain
    assert (gain.apart is not None) == is_followed


@pytest.mark.parametrize(
    ("left", "is_too_much"),
    [(1.6, False), (3.4, False), (3.8, True)],  # of 30 floors, an eighth may be left
)
def test_beside_a_name_as_little_may_be_left_as_no_model_of_a_large_cause_is_without(
    left: float, is_too_much: bool, tmp_path
):
    searches = Searches(tmp_path)
    before, after = 30.0 * _USUAL / _USUAL.mean(), left * _USUAL / _USUAL.mean()
    found = searches.search(before)
    found.accepted.append(searches.tried(ELBOW, before, after))
    found.current_losses = after
    assert is_open(found) is is_too_much


@pytest.mark.parametrize(
    ("before", "left", "is_too_much"),
    [(200.0, 9.0, False), (200.0, 11.0, True), (20000.0, 39.0, False), (20000.0, 41.0, True)],
)
def test_where_the_base_is_doubted_less_may_be_left(
    before: float, left: float, is_too_much: bool, tmp_path: Path
) -> None:
    searches = Searches(tmp_path)
    first, after = before * _USUAL / _USUAL.mean(), left * _USUAL / _USUAL.mean()
    found = searches.search(first)
    found.doubted = ("mass elbow",)
    found.accepted.append(searches.tried(ELBOW, first, after))
    found.current_losses = after
    assert is_open(found) is is_too_much


@pytest.mark.parametrize(("of_freer", "is_much"), [(90.0, False), (20.0, True), (None, False)])
def test_what_may_be_left_goes_by_a_base_that_may_bend_more(
    tmp_path: Path, of_freer: float | None, is_much: bool
):
    searches = Searches(tmp_path)
    base = np.full(4, 100.0)
    found = searches.search(base, searches.tried(ELBOW, base, np.full(4, 5.0)))
    if of_freer is not None:
        found.freer = Model(searches.base, np.full(4, of_freer))
    assert is_open(found) is is_much
