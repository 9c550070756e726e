"""The gate: an interval that covers, and nothing passes that is not sure and enough."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from shared.identification.gate.held_out import STRETCH, Gain, Taken, compare, floor_of, stretches
from tests.measured import measure, nominal, problem_of


@pytest.mark.parametrize("count", [3, 8, 40])
def test_an_interval_covers_the_truth_in_95_of_100_cases(count: int):
    rng = np.random.default_rng(1)
    hits = 0
    for _ in range(400):
        after = 1.0 + 0.2 * rng.standard_normal(count)
        gain = compare(after + 0.5 + 0.3 * rng.standard_normal(count), after, rng)
        hits += gain.low <= 0.5 <= gain.high
    assert 0.92 <= hits / 400 <= 0.98


def test_one_stretch_is_sure_of_nothing_however_much_is_taken_off():
    gain = compare(np.array([100.0]), np.array([1.0]), np.random.default_rng(0))
    assert gain.gain == 99.0
    assert gain.low < 0.0 < gain.high
    assert not gain.is_useful(100.0)


def test_what_is_taken_off_everywhere_is_sure():
    rng = np.random.default_rng(0)
    gain = compare(np.full(12, 4.0), np.full(12, 1.5), rng)
    assert (gain.loss, gain.before, gain.gain) == (1.5, 4.0, 2.5)
    assert gain.low == gain.high == pytest.approx(2.5)
    assert gain.share(4.0) == pytest.approx(2.5 / (4.0 - 1.15))
    assert gain.is_useful(4.0)


def test_a_cause_is_useful_only_if_it_is_sure_and_enough():
    def gain(before: float, loss: float, surely: float) -> Gain:
        return Gain(loss, before, 0.0, 0.0, surely, 0.1)

    assert gain(3.0, 2.0, 0.5).is_useful(3.0)
    assert not gain(3.0, 2.0, -0.01).is_useful(3.0)  # not sure
    assert not gain(3.0, 2.95, 0.01).is_useful(3.0)  # 2.7 % of what can be explained
    assert not gain(3.0, 2.0, 0.5).is_useful(100.0)  # 1 % of what could be explained
    assert not gain(100.0, 99.0, 0.5).is_useful(10.0)  # 1 % of what is left


@pytest.mark.parametrize(("share", "is_enough"), [(0.05, True), (0.03, False)])
def test_a_small_cause_passes_by_its_loss_where_links_cannot_make_up_for_it(
    share: float, is_enough: bool
):
    found = Gain(1.05 * (1.0 - share), 1.05, 0.0, 0.0, 0.01, 0.01, is_measured=True)
    assert found.is_useful(1.05) == is_enough
    assert replace(found, is_far_from_links=True).is_useful(1.05)
    assert not replace(found, is_far_from_links=True, surely=-0.01).is_useful(1.05)
    assert not replace(found, is_far_from_links=True, loss=1.04).is_useful(1.05)


def test_what_links_could_not_make_up_for_need_not_explain_what_a_right_model_may_leave():
    found = Gain(1.106, 1.133, 0.0, 0.05, 0.01, 0.01, is_measured=True)
    assert not found.is_useful(1.133)  # less than a quarter of 0.133
    assert replace(found, is_far_from_links=True).is_useful(1.133)


def test_beside_a_far_larger_cause_a_quarter_of_what_noise_does_not_account_for_is_of_use():
    def gain(before: float, loss: float, is_measured: bool) -> Gain:
        return Gain(loss, before, 0.0, 0.0, 0.2, 0.1, is_measured)

    assert gain(2.2, 1.3, True).is_useful(105.0)
    assert gain(2.2, 1.85, True).is_useful(60.0)
    assert not gain(2.2, 1.95, True).is_useful(60.0)  # a larger one is never modelled exactly
    assert not gain(2.2, 1.85, True).is_useful(105.0)  # 0.3 % of what it took off
    assert not gain(2.2, 1.3, False).is_useful(105.0)  # who knows what of it is noise


def test_what_happened_once_is_in_one_stretch_and_in_none_where_it_is_not_counted(tmp_path: Path):
    problem = problem_of(measure(tmp_path, np.random.default_rng(0), seconds=4.0))
    (held_out,) = problem.of("test")
    quiet = stretches(problem, nominal(problem), (held_out,))
    assert len(quiet) == 4.0 / STRETCH
    assert quiet.max() < 2.0
    problem.segments[held_out].q[110:140] += 0.05  # rad, from 1.1 s to 1.4 s
    struck = stretches(problem, nominal(problem), (held_out,))
    assert struck[2] > 1000.0
    assert np.delete(struck, 2) == pytest.approx(np.delete(quiet, 2))
    blocks = problem.shape_of(held_out)[0]
    problem.uncounted[held_out] = np.arange(blocks) // (blocks // 8) == 2
    assert stretches(problem, nominal(problem), (held_out,)) == pytest.approx(np.delete(quiet, 2))
    problem.uncounted[held_out][:] = True
    assert len(stretches(problem, nominal(problem), (held_out,))) == 0


def test_the_floor_is_always_below_the_base():
    assert floor_of(10.0) == 1.15
    assert floor_of(1.0) == pytest.approx(0.7)


@pytest.mark.parametrize(
    ("before", "gain", "is_measured", "is_enough"),
    [
        (1.05, 0.045, True, True),
        (1.05, 0.045, False, False),
        (1.05, 0.03, True, False),  # hardly anything
        (1.4, 0.09, True, False),  # the base is not quite right, and many take some of that off
        (1.4, 0.11, True, True),
        (3.0, 0.26, True, True),
        (10.0, 0.5, True, False),
        (10.0, 0.7, False, True),
    ],
)
def test_how_much_is_enough_depends_on_what_is_left_beyond_measured_noise(
    before: float, gain: float, is_measured: bool, is_enough: bool
):
    loss = before - gain
    found = Gain(loss, before, 0.5 * gain, 1.5 * gain, 0.1 * gain, 0.2 * gain, is_measured)
    assert found.is_sure == is_enough


@pytest.mark.parametrize(
    ("before", "gain", "is_enough"),
    [
        (1.05, 0.004, True),
        (1.05, 0.002, False),  # of no use to anybody
        (1.4, 0.05, False),  # the base is not quite right: it is sure, and may be the base's fault
        (1.4, 0.09, True),
    ],
)
def test_of_a_cause_that_what_is_held_out_follows_little_is_enough(
    before: float, gain: float, is_enough: bool
):
    found = Gain(
        before - gain, before, -gain, 3.0 * gain, -2.0 * gain, gain, is_measured=True,
        apart=Taken(before, gain),
    )  # fmt: skip
    assert found.is_sure == found.is_useful(before) == is_enough
    assert not replace(found, apart=None).is_sure


def test_what_was_not_shown_of_the_base_has_no_say_in_a_cause_that_is_followed():
    """The loss itself is of a base that is wrong where only held-out motion goes."""
    found = Gain(1.99, 2.0, -0.1, 0.12, -0.2, 0.05, is_measured=True, apart=Taken(1.02, 0.04))
    assert found.is_useful(2.0)
    assert not replace(found, apart=Taken(1.6, 0.04)).is_sure
