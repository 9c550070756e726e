"""What is new in noise that goes on, against noise of a known memory."""

import numpy as np
import pytest

from shared.identification.dataset.types import Float64
from shared.identification.noise.memory import Memory, memory_of, wandering


def carried_on(rng: np.random.Generator, kept: float, blocks: int, channels: int = 3) -> Float64:
    """Return float64[blocks, channels], AR(1) noise of variance 1."""
    out = rng.standard_normal((blocks, channels))
    for index in range(1, blocks):
        out[index] = kept * out[index - 1] + np.sqrt(1.0 - kept**2) * out[index]
    return out


@pytest.mark.parametrize("kept", [0.0, 0.6, 0.9])
def test_what_is_carried_on_and_what_is_new_are_found_from_two_repeats(kept: float):
    rng = np.random.default_rng(1)
    apart = [2.0 * (carried_on(rng, kept, 300) - carried_on(rng, kept, 300)) for _ in range(2)]
    found = memory_of(apart, 0.5 * np.sqrt(0.5), np.zeros(3))
    assert found.kept == pytest.approx(kept, abs=0.08)
    assert found.fresh == pytest.approx(np.sqrt(1.0 - kept**2), rel=0.15)


def test_news_of_noise_are_white_and_of_variance_one():
    noise = carried_on(np.random.default_rng(2), 0.9, 4000)
    found = Memory(np.full(3, 0.9), np.full(3, np.sqrt(1.0 - 0.9**2))).news(noise)
    assert found.shape == noise.shape
    assert np.mean(found**2, axis=0) == pytest.approx(1.0, rel=0.1)
    assert np.mean(found[1:] * found[:-1], axis=0) == pytest.approx(0.0, abs=0.06)


def test_what_is_slow_counts_for_less_and_what_is_fast_for_more():
    memory = Memory(np.full(1, 0.9), np.full(1, np.sqrt(1.0 - 0.9**2)))
    slow, fast = np.ones((200, 1)), (-1.0) ** np.arange(200.0)[:, None]
    assert np.mean(memory.news(slow)[1:] ** 2) == pytest.approx(0.1 / 1.9)
    assert np.mean(memory.news(fast)[1:] ** 2) == pytest.approx(1.9 / 0.1)


def test_noise_that_hardly_ends_still_leaves_what_is_slow_a_say():
    walk = np.cumsum(np.random.default_rng(3).standard_normal((400, 2)), axis=0)
    assert memory_of([walk], 1.0, np.zeros(2)).kept == pytest.approx(0.95)


def test_what_is_new_is_never_under_what_a_readings_steps_hide():
    still = [np.zeros((50, 2))]
    assert memory_of(still, 1.0, np.full(2, 0.3)).fresh == pytest.approx(0.3)


def test_of_series_too_short_to_say_nothing_is_carried_on():
    found = memory_of([np.ones((1, 2)), np.ones((0, 2))], 1.0, np.zeros(2))
    assert found.news(np.array([[1.0, 2.0], [3.0, 4.0]])).tolist() == [[1.0, 2.0], [3.0, 4.0]]


def test_channels_follow_those_of_another():
    joints, tracker = Memory(np.array([0.5]), np.array([0.8])), Memory(np.zeros(2), np.ones(2))
    found = joints.beside(tracker)
    assert found.kept.tolist() == [0.5, 0.0, 0.0]
    assert found.fresh.tolist() == [0.8, 1.0, 1.0]


_AXES = (slice(0, 3), slice(3, 6))


def drifting(rng: np.random.Generator, drift: float, blocks: int = 600) -> Float64:
    """Return float64[blocks, 6]: noise of 0.04 s, the first three of which drift in 8 s as well."""
    out = carried_on(rng, 0.6, blocks, 6)
    out[:, :3] += drift * carried_on(rng, float(np.exp(-0.02 / 8.0)), blocks)
    return out


def _found(drift: float) -> tuple[Memory, Memory]:
    """Return what two pairs of repeats say, without a level and with one."""
    rng = np.random.default_rng(5)
    apart = [drifting(rng, drift) - drifting(rng, drift) for _ in range(2)]
    plain = memory_of(apart, np.sqrt(0.5), np.zeros(6))
    return plain, wandering(plain, apart, np.sqrt(0.5), _AXES)


def _offsets(memory: Memory, drift: float) -> tuple[Float64, Float64]:
    """Return float64[6]: what a recording's offset is off by, as is thought and in truth."""
    way = memory.news(np.ones((600, 6)))[1:]
    size = np.sum(way**2, axis=0)
    rng = np.random.default_rng(6)
    of_each = [memory.news(drifting(rng, drift))[1:] for _ in range(100)]
    off = np.array([np.sum(way * news, axis=0) / size for news in of_each])
    return 1.0 / np.sqrt(size), np.sqrt(np.mean(off**2, axis=0))


def test_how_far_a_recordings_offset_is_off_is_known_where_a_tracker_drifts():
    plain, memory = _found(0.33)
    thought, off = _offsets(memory, 0.33)
    assert (off[:3] < 1.6 * thought[:3]).all()
    assert (off[:3] > 0.8 * thought[:3]).all()
    thought, off = _offsets(plain, 0.33)
    assert (off[:3] > 3.0 * thought[:3]).all()


def test_what_drifts_says_nothing_of_channels_of_another_kind():
    plain, memory = _found(0.33)
    assert (memory.wanders[:3] > 0.0).all()
    thought, off = _offsets(memory, 0.33)
    assert off[3:] == pytest.approx(thought[3:], rel=0.4)
    assert thought[3:].max() < 0.6 * thought[:3].min()
    assert memory.kept == pytest.approx(plain.kept)


def test_news_of_what_drifts_are_of_variance_one():
    _, memory = _found(0.33)
    news = memory.news(drifting(np.random.default_rng(7), 0.33, 4000))
    assert np.mean(news[1:] ** 2, axis=0) == pytest.approx(1.0, rel=0.15)


def test_of_series_too_short_to_say_no_level_wanders():
    memory = memory_of([np.ones((1, 6))], 1.0, np.zeros(6))
    assert wandering(memory, [np.ones((1, 6))], 1.0, _AXES) == memory
