"""Torques that were missing for a moment are told from laws that go with what the arm does."""

from dataclasses import replace

import numpy as np
import pytest

from shared.identification.dataset.types import Float64
from shared.identification.fitting.problem import BLOCK
from shared.identification.leftover.pushes import pushes_of
from shared.identification.leftover.tracks import Track

_AT = BLOCK * (np.arange(1000) + 0.5)
_BEGINS = (2.4, 6.6, 11.2, 17.0)


def track(number: int, x: Float64) -> Track:
    """Return one joint that swings, each recording from another posture on."""
    angle = 2.0 * np.pi * 0.31 * _AT + number
    q, qd = np.sin(angle)[:, None], (2.0 * np.pi * 0.31 * np.cos(angle))[:, None]
    return Track(number, _AT, x[:, None], q, qd, 3.0 * qd, 3.0 * qd, None)


def noise(rng: np.random.Generator) -> Float64:
    """Return missing torque of a right model, smooth over five blocks (0.1 N m)."""
    return 0.22 * np.convolve(rng.standard_normal(len(_AT)), np.ones(5) / 5.0, "same")


def pulse(begin: float, size: float = 2.0) -> Float64:
    return np.convolve(size * ((begin <= _AT) & (begin + 0.4 > _AT)), np.ones(5) / 5.0, "same")


@pytest.mark.parametrize("number", [0, 1])
@pytest.mark.parametrize("begins", [_BEGINS, _BEGINS[1:2]])
def test_pushes_are_found_in_their_recording_when_they_were(
    number: int, begins: tuple[float, ...]
) -> None:
    rng = np.random.default_rng(4)
    torques = [noise(rng), noise(rng)]
    torques[number] += np.sum([pulse(begin) for begin in begins], axis=0)
    tracks = [track(index, 20.0 * torque) for index, torque in enumerate(torques)]
    found = pushes_of(tracks, [each[:, None] for each in torques])
    assert [(each.track, each.joint) for each in found] == [(number, 0)] * len(begins)
    assert [each.begin for each in found] == pytest.approx(begins, abs=0.06)
    assert [each.end - each.begin for each in found] == pytest.approx([0.4] * len(begins), abs=0.1)


@pytest.mark.parametrize(("begin", "pushes"), [(0.05, 0), (0.6, 1)])
def test_what_is_there_from_the_begin_is_no_push(begin: float, pushes: int) -> None:
    torque = noise(np.random.default_rng(7)) + pulse(begin)
    assert len(pushes_of([track(0, 20.0 * torque)], [torque[:, None]])) == pushes


def test_what_comes_back_at_every_reversal_is_no_push() -> None:
    rng = np.random.default_rng(5)
    tracks = [track(index, np.full(len(_AT), 30.0)) for index in range(2)]
    torques = [noise(rng) + 2.0 * (each.qd[:, 0] > 1.8) for each in tracks]
    assert pushes_of(tracks, [each[:, None] for each in torques]) == ()


def test_what_lets_go_after_reversals_is_no_push() -> None:
    rng = np.random.default_rng(6)
    tracks = [track(index, np.full(len(_AT), 30.0)) for index in range(2)]
    torques: list[Float64] = []
    for each in tracks:
        turns = _AT[:-1][np.diff(np.sign(each.qd[:, 0])) != 0.0]
        begins = turns[rng.random(len(turns)) < 0.4] + 0.1
        torques.append(noise(rng) + np.sum([pulse(begin) for begin in begins], axis=0))
    assert pushes_of(tracks, [each[:, None] for each in torques]) == ()


def test_where_something_is_known_to_have_happened_a_push_may_come_after_a_reversal() -> None:
    rng = np.random.default_rng(6)
    tracks = [track(index, np.full(len(_AT), 30.0)) for index in range(2)]
    turns = _AT[:-1][np.diff(np.sign(tracks[0].qd[:, 0])) != 0.0]
    begin = float(turns[2]) + 0.15
    torques = [noise(rng) + pulse(begin), noise(rng)]
    both = [each[:, None] for each in torques]
    assert pushes_of(tracks, both) == ()
    happened = [(begin - 0.2 < _AT) & (begin + 0.6 > _AT), np.zeros(len(_AT), np.bool_)]
    (found,) = pushes_of(tracks, both, happened)
    assert found.track == 0
    assert (found.begin, found.end) == pytest.approx((begin, begin + 0.4), abs=0.06)


def test_noise_is_no_push_and_neither_is_what_no_position_shows() -> None:
    for seed in range(5):
        rng = np.random.default_rng(seed)
        quiet = [noise(rng), noise(rng)]
        shown = [track(index, np.full(len(_AT), 30.0)) for index in range(2)]
        assert pushes_of(shown, [each[:, None] for each in quiet]) == ()
        loud = [quiet[0] + pulse(6.0), quiet[1]]
        hidden = [track(index, np.zeros(len(_AT))) for index in range(2)]
        assert pushes_of(hidden, [each[:, None] for each in loud]) == ()


@pytest.mark.parametrize("is_alone", [True, False])
@pytest.mark.parametrize(
    ("counts", "recurs"),
    [
        ((2, 2, 1, 0), True),
        ((2, 2, 0, 0), False),
        ((2, 1, 1, 0), False),
        ((4, 1, 1, 0, 0, 0), False),
    ],
)
def test_what_comes_again_at_one_joint_in_most_recordings_is_a_law(
    counts: tuple[int, ...], recurs: bool, is_alone: bool
) -> None:
    rng = np.random.default_rng(7)
    pushed = [
        noise(rng) + np.sum([pulse(begin) for begin in _BEGINS[:count]], axis=0) for count in counts
    ]
    beside = [noise(rng) if is_alone else each.copy() for each in pushed]
    both = [np.stack(each, axis=1) for each in zip(pushed, beside, strict=True)]
    tracks = [_wide(track(index, 20.0 * each)) for index, each in enumerate(pushed)]
    found = pushes_of(tracks, both)
    assert [each.is_again for each in found if each.joint == 0] == [recurs and is_alone] * sum(
        counts
    )


def _wide(one: Track) -> Track:
    """Return the same of two joints that do alike."""
    twice = {
        name: np.repeat(getattr(one, name), 2, axis=1)
        for name in ("x", "q", "qd", "effort", "load")
    }
    return replace(one, **twice)
