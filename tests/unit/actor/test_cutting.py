import dataclasses

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from services.actor.collector import Segment
from services.actor.cutting import cut, parts_of
from shared.messages.topics import ROLLOUT
from shared.messages.training import ACTION_DIM, OBS_DIM, Rollout
from shared.messages.wire import encode


def a_segment(steps: int, worlds: int) -> Segment:
    """A segment of which every number is another one."""
    count = iter(range(100))

    def numbers(*shape: int) -> np.ndarray:
        size = int(np.prod(shape))
        return (np.arange(size, dtype=np.float32) + 1e4 * next(count)).reshape(shape)

    return Segment(
        bouts=np.arange(worlds), first_step=np.arange(worlds, dtype=np.int32),
        obs=numbers(steps, worlds, OBS_DIM), last_obs=numbers(worlds, OBS_DIM),
        actions=numbers(steps, worlds, ACTION_DIM), means=numbers(steps, worlds, ACTION_DIM),
        log_probs=numbers(steps, worlds), rewards=numbers(steps, worlds),
        truncated=np.arange(worlds) % 2 == 0, results=None,
    )  # fmt: skip


def encoded(segment: Segment) -> int:
    """Bytes of the message that carries a segment, its names as long as they may be."""
    values = {
        field.name: getattr(segment, field.name)
        for field in dataclasses.fields(segment)
        if field.name != "results"
    }
    return len(
        encode(
            Rollout(
                agent="antagonist", actor="a" * 64, boot="b" * 64, sequence=2**62, lease="l" * 64,
                stage=2**30, policy_version=2**30, snapshot="s" * 64, opponent="o" * 80,
                model="m" * 64, seed=2**62, stds=np.ones(ACTION_DIM, np.float32), **values,
            )
        )
    )  # fmt: skip


@pytest.mark.parametrize(("steps", "worlds"), [(40, 128), (40, 4096), (2000, 256), (1, 4096)])
def test_every_part_fits_into_a_message_and_one_part_less_would_not(steps: int, worlds: int):
    parts = parts_of(steps, worlds)
    sizes = [encoded(part) for part in cut(a_segment(steps, worlds), parts)]
    assert max(sizes) <= ROLLOUT.max_bytes
    if parts > 1:
        fewer = [encoded(part) for part in cut(a_segment(steps, worlds), parts - 1)]
        assert max(fewer) > 0.98 * ROLLOUT.max_bytes
    else:
        assert sum(sizes) <= ROLLOUT.max_bytes


def test_the_default_actor_sends_what_it_plays_at_a_time_as_one():
    assert parts_of(40, 128) == 1
    segment = a_segment(2, 3)
    assert cut(segment, 1) == [segment]


@given(worlds=st.integers(1, 40), parts=st.integers(1, 8))
def test_parts_put_together_are_the_segment(worlds: int, parts: int):
    whole = a_segment(3, worlds)
    pieces = cut(whole, min(parts, worlds))
    sizes = [len(piece.bouts) for piece in pieces]
    assert max(sizes) - min(sizes) <= 1
    for name, axis in (
        ("bouts", 0), ("first_step", 0), ("obs", 1), ("last_obs", 0), ("actions", 1), ("means", 1),
        ("log_probs", 1), ("rewards", 1), ("truncated", 0),
    ):  # fmt: skip
        joined = np.concatenate([getattr(piece, name) for piece in pieces], axis=axis)
        np.testing.assert_array_equal(joined, getattr(whole, name))


def test_a_rollout_of_which_not_even_one_world_fits_is_refused():
    with pytest.raises(ValueError, match=r"rollout_steps \(100000\) .* too long for a message"):
        parts_of(100_000, 1)
