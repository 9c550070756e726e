"""The last fit, to all recordings."""

from dataclasses import replace

import numpy as np
import pytest

from shared.identification.catalogue.torque_bias import EFFECT as BIAS
from shared.identification.conclusion.conclude import conclude
from shared.identification.fitting.fit import Fit, polish
from shared.identification.fitting.space import Space
from shared.identification.fitting.whole import (
    _with_more,  # pyright: ignore[reportPrivateUsage]
    fit_to_all,
)
from shared.identification.search.searched import Search
from shared.identification.verdict import Unexplained
from shared.sim.plant.row import Row
from tests.searches import ELBOW, Searches

_BAD, _GOOD = np.linspace(8.0, 12.0, 8), np.linspace(1.0, 1.2, 8)
_TORQUE = 0.3


def _pulled(row: Row) -> None:
    BIAS.enter(row, "elbow", np.array([_TORQUE]))


def _push(trajectory: str) -> Unexplained:
    return Unexplained(
        where="elbow", trajectory=trajectory, begin=0.5, end=0.6, phase="once", size=0.01,
        unit="rad", times_noise=9.0, is_external=True,
    )  # fmt: skip


@pytest.fixture(scope="module")
def searches(tmp_path_factory: pytest.TempPathFactory) -> Searches:
    return Searches(tmp_path_factory.mktemp("data"), seconds=4.0, enter=_pulled)


def _found(searches: Searches) -> Search:
    """Return a search that took the elbow's torque, fitted to ``first`` and ``again``."""
    space = Space(searches.problem, (ELBOW,))
    fit = polish(space, np.zeros(space.size), searches.problem.of("train"), 4)
    tried = replace(searches.tried(ELBOW, _BAD, _GOOD), fit=fit)
    return searches.search(_BAD, tried)


def test_sizes_are_told_from_all_recordings_and_held_out_figures_are_not(searches: Searches):
    found = _found(searches)
    before = conclude(found, ())
    fit_to_all(found, ())
    assert found.final is not None
    assert found.fitted_to == (*searches.problem.of("train"), *searches.problem.of("test"))
    after = conclude(found, ())
    assert after.held_out == before.held_out
    (one,), (other,) = before.causes, after.causes
    assert (one.effect, one.where) == (other.effect, other.where) == ("torque_bias", "elbow")
    assert abs(other.value - _TORQUE) < 0.02
    assert one.value != other.value
    wider = (other.interval.high - other.interval.low) / (one.interval.high - one.interval.low)
    assert 1.0 - 1e-9 < wider < 1.5
    told = {each.name: each.extended for each in after.base}
    final = dict(zip(told, found.final.z, strict=False))
    for each in searches.problem.parameters:
        assert told[each.name] == pytest.approx(each.value(float(final[each.name])))


def test_what_links_alone_say_is_not_told_more_surely_than_they_do(searches: Searches):
    """An arm with all masses, gains, friction and torques larger moves the same."""
    found = _found(searches)
    fit_to_all(found, ())
    assert found.final is not None

    def shows(fit: Fit) -> tuple[float, float]:
        """Return how much recordings seem to show of that, and what is known beforehand."""
        more = [
            1.0 if each.is_factor else each.value(float(z)) / each.scale
            for each, z in zip(searches.problem.parameters, fit.z, strict=False)
        ]
        along = np.r_[more, fit.z[len(more) :]]
        change, rows = fit.jacobian @ along, len(fit.residual) - fit.space.size
        return float(np.linalg.norm(change[:rows])), float(np.linalg.norm(change[rows:]))

    for fit, most in ((found.current, 0.6), (found.final, 0.2)):
        shown, known = shows(fit)
        assert shown < most * known


def test_what_is_known_of_the_fit_is_not_simulated_again(searches: Searches):
    """The derivative at the begin is asked of the held-out recordings alone, and is the same."""
    found = _found(searches)
    fresh = Fit.at(found.current.space, found.current.z, found.problem.of("train"))
    known = _with_more(fresh, found.problem.of("test"))
    everything = (*found.problem.of("train"), *found.problem.of("test"))
    whole = Fit.at(fresh.space, fresh.z, everything)
    np.testing.assert_array_equal(known.residual, whole.residual)
    np.testing.assert_array_equal(known.jacobian, whole.jacobian)


def test_the_interval_of_a_cause_that_only_all_recordings_show_is_theirs(searches: Searches):
    found = _found(searches)
    jacobian = found.current.jacobian.copy()
    jacobian[:, found.current.space.where(ELBOW)] *= 1e-3
    found.current = replace(found.current, jacobian=jacobian)
    (alone,) = conclude(found, ()).causes
    assert alone.interval.low < 0.0 < alone.interval.high
    fit_to_all(found, ())
    (together,) = conclude(found, ()).causes
    assert 0.0 < together.interval.low < _TORQUE < together.interval.high


def test_recordings_in_which_something_pushed_have_no_say(searches: Searches):
    found = _found(searches)
    train, test = (searches.problem.of(split) for split in ("train", "test"))
    fit_to_all(found, (_push("second"),))
    assert found.fitted_to == train
    fit_to_all(found, (_push("first"),))
    assert found.fitted_to == (*train, *test)


def test_blocks_that_do_not_count_keep_their_recording_out(searches: Searches):
    found = _found(searches)
    (segment,) = searches.problem.of("test")
    rows = searches.problem.shape_of(segment)[0]
    uncounted = {segment: np.zeros(rows, np.bool_)}
    found.problem = replace(searches.problem, uncounted=uncounted)
    fit_to_all(found, ())
    assert found.fitted_to == searches.problem.of("train")


def test_a_base_by_itself_is_not_fitted_again_where_little_is_left(searches: Searches):
    found = searches.search(_GOOD)
    fit_to_all(found, ())
    assert found.final is None
    assert found.by_all is None


def test_what_goes_once_held_out_recordings_have_a_say_is_not_left_unexplained(searches: Searches):
    space = Space(searches.problem, (ELBOW,))
    fit = polish(space, np.zeros(space.size), searches.problem.of("train"), 4)
    tried = replace(searches.tried(ELBOW, _BAD, 3.0 * _GOOD), fit=fit)
    found = searches.search(_BAD, tried)
    assert conclude(found, ()).word == "unexplained"
    fit_to_all(found, ())
    assert found.by_all is not None
    assert 0.5 < found.by_all.plain < 1.5
    after = conclude(found, ())
    assert after.word == "named"
    assert after.held_out.by_all == pytest.approx(np.sqrt(found.by_all.plain))
    assert f"{after.held_out.by_all:.2f} once it is fitted to these, too" in after.sentence


def test_what_stays_with_every_recording_in_the_fit_is_unexplained(searches: Searches):
    found = searches.search(_BAD)
    fit_to_all(found, ())
    assert found.final is None
    assert found.by_all is not None
    assert found.by_all.new > 2.0
    assert conclude(found, ()).word == "unexplained"


def test_without_a_measured_floor_held_out_recordings_have_no_say_in_what_is_left(
    searches: Searches,
):
    found = searches.search(_BAD)
    noise = replace(searches.problem.noise, is_measured=False)
    found.problem = replace(searches.problem, noise=noise)
    fit_to_all(found, ())
    assert found.by_all is None
