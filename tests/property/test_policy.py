"""Encoder, decoder and artifact against slow references, for any input."""

import contextlib
import json
import math
from typing import Any

import numpy as np
from hypothesis import example, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays
from numpy.typing import NDArray

from shared.errors import SnapshotError
from shared.policy.action import ActionConfig, bounded_offset, desired_pose
from shared.policy.observation import OTHER_REFERENCE, OWN_REFERENCE, ObservationEncoder
from shared.policy.snapshot import unpack
from tests.unit.policy.making import snapshot

Floats = NDArray[np.float64]
SEEDS = st.integers(0, 2**32 - 1)
CENTRE = (0.1, -0.2, 1.05)
Quaternion = tuple[float, float, float, float]


def product(p: Quaternion, q: Quaternion) -> Quaternion:
    """Hamilton's product, w x y z."""
    a, b, c, d = p
    e, f, g, h = q
    return (
        a * e - b * f - c * g - d * h,
        a * f + b * e + c * h - d * g,
        a * g - b * h + c * e + d * f,
        a * h + b * g - c * f + d * e,
    )


def random_bats(generator: np.random.Generator, worlds: int) -> Floats:
    """float64[N, 26], with unit quaternions."""
    bats = generator.normal(size=(worlds, 2, 13))
    bats[:, :, 3:7] /= np.linalg.norm(bats[:, :, 3:7], axis=2, keepdims=True)
    bats[:, :, 0:3] += CENTRE
    return bats.reshape(worlds, 26)


def turned(vector: Floats, angle: float) -> list[float]:
    """A vector turned about z."""
    x, y, z = vector
    return [
        math.cos(angle) * x - math.sin(angle) * y, math.sin(angle) * x + math.cos(angle) * y, z,
    ]  # fmt: skip


def slow_bat(bat: Floats, yaw: float, reference: Quaternion) -> tuple[list[float], float]:
    """One bat in the arena frame of a side, and how far its sign is from undecided."""
    half: Quaternion = (math.cos(-yaw / 2), 0.0, 0.0, math.sin(-yaw / 2))
    q = product(half, (bat[3], bat[4], bat[5], bat[6]))
    likeness = sum(a * b for a, b in zip(q, reference, strict=True))
    sign = 1.0 if likeness >= 0 else -1.0
    numbers = turned(bat[0:3] - np.array(CENTRE), -yaw)
    numbers += [sign * part for part in q]
    numbers += turned(bat[7:10], -yaw) + turned(bat[10:13], -yaw)
    return numbers, abs(likeness)


def encode(bats: Floats, seconds: Floats, yaws: tuple[float, ...]) -> list[NDArray[np.float32]]:
    outs = [np.full((len(bats), 27), np.nan, np.float32) for _ in yaws]
    ObservationEncoder(CENTRE, yaws).encode(bats, seconds, outs)
    return outs


@settings(deadline=None)
@given(SEEDS, st.tuples(st.floats(-7.0, 7.0), st.floats(-7.0, 7.0)))
@example(0, (math.pi, 0.0))
@example(1, (0.0, math.pi))
def test_the_encoder_equals_the_slow_one(seed: int, yaws: tuple[float, float]) -> None:
    generator = np.random.default_rng(seed)
    bats = random_bats(generator, 4)
    seconds = generator.uniform(0, 20, 4)
    for own, out in enumerate(encode(bats, seconds, yaws)):
        for world in range(4):
            mine = bats[world, 13 * own : 13 * own + 13]
            other = bats[world, 13 * (1 - own) : 13 * (1 - own) + 13]
            numbers: list[float] = []
            for bat, reference in ((mine, OWN_REFERENCE), (other, OTHER_REFERENCE)):
                part, certainty = slow_bat(bat, yaws[own], reference)
                at = len(numbers)
                numbers += part
                if certainty < 1e-5:  # either sign is right
                    numbers[at + 3 : at + 7] = out[world, at + 3 : at + 7].tolist()
            np.testing.assert_allclose(out[world, :26], numbers, atol=2e-5)
            assert out[world, 26] == np.float32(seconds[world])


@settings(deadline=None)
@given(SEEDS)
def test_a_quaternion_and_its_negative_look_the_same(seed: int) -> None:
    generator = np.random.default_rng(seed)
    bats = random_bats(generator, 8)
    flipped = bats.copy().reshape(8, 2, 13)
    flipped[:, :, 3:7] *= generator.choice([-1.0, 1.0], (8, 2, 1))
    seconds = np.zeros(8)
    for one, other in zip(
        encode(bats, seconds, (math.pi, 0.0)),
        encode(flipped.reshape(8, 26), seconds, (math.pi, 0.0)),
        strict=True,
    ):
        np.testing.assert_array_equal(one, other)


@settings(deadline=None)
@given(SEEDS)
def test_both_sides_see_a_scene_and_its_mirror_by_half_a_turn_alike(seed: int) -> None:
    generator = np.random.default_rng(seed)
    bats = random_bats(generator, 5).reshape(5, 2, 13)
    swapped = np.empty_like(bats)
    for world in range(5):
        for side in range(2):
            bat = bats[world, side]
            swapped[world, 1 - side, 0:3] = CENTRE + np.array(
                turned(bat[0:3] - np.array(CENTRE), math.pi)
            )
            swapped[world, 1 - side, 3:7] = product(
                (math.cos(math.pi / 2), 0.0, 0.0, math.sin(math.pi / 2)), tuple(bat[3:7])
            )
            swapped[world, 1 - side, 7:10] = turned(bat[7:10], math.pi)
            swapped[world, 1 - side, 10:13] = turned(bat[10:13], math.pi)
    seconds = np.full(5, 3.0)
    antagonist, protagonist = encode(bats.reshape(5, 26), seconds, (math.pi, 0.0))
    other_antagonist, other_protagonist = encode(swapped.reshape(5, 26), seconds, (math.pi, 0.0))
    np.testing.assert_allclose(other_protagonist, antagonist, atol=2e-5)
    np.testing.assert_allclose(other_antagonist, protagonist, atol=2e-5)


ANY_ACTION = arrays.arrays(
    np.float64,
    st.tuples(st.just(6), st.integers(1, 4)),
    elements=st.floats(allow_nan=False, allow_infinity=False, width=32),
)


@settings(deadline=None)
@given(ANY_ACTION, st.floats(0.001, 0.3), st.floats(0.001, 1.0))
def test_no_action_leaves_its_bounds(actions: Floats, metres: float, radians: float) -> None:
    offsets = bounded_offset(actions, ActionConfig(offset_bound_m=metres, offset_bound_rad=radians))
    assert np.isfinite(offsets).all()
    assert (np.linalg.norm(offsets[:3], axis=0) <= metres * (1 + 1e-12)).all()
    assert (np.linalg.norm(offsets[3:], axis=0) <= radians * (1 + 1e-12)).all()


@settings(deadline=None)
@given(SEEDS)
def test_short_actions_are_scaled_and_long_ones_keep_their_direction(seed: int) -> None:
    cfg = ActionConfig()
    generator = np.random.default_rng(seed)
    actions = generator.normal(size=(2, 6, 5)) * 10.0 ** generator.uniform(-3, 3, (2, 1, 5))
    offsets = bounded_offset(actions, cfg)
    for side in range(2):
        for world in range(5):
            for part, bound in ((slice(0, 3), cfg.offset_bound_m), (slice(3, 6), 0.06)):
                asked = actions[side, part, world]
                expected = bound * asked / max(1.0, math.hypot(*asked))
                np.testing.assert_allclose(offsets[side, part, world], expected, rtol=1e-12)


@settings(deadline=None)
@given(SEEDS, st.floats(0.0, 1.0))
@example(0, 0.0)
def test_the_desired_pose_is_the_tool_moved_and_turned(seed: int, angle: float) -> None:
    generator = np.random.default_rng(seed)
    axis = generator.normal(size=3)
    axis /= np.linalg.norm(axis)
    rotation = 2.0 * math.tan(angle / 2) * axis
    offsets = np.concatenate([generator.normal(size=3), rotation])[:, None]
    tools = generator.normal(size=(7, 1))
    tools[3:] /= np.linalg.norm(tools[3:], axis=0)
    untouched = tools.copy()
    found = desired_pose(offsets, tools)[:, 0]
    half: Quaternion = (math.cos(angle / 2), *(math.sin(angle / 2) * axis))  # type: ignore[assignment]
    np.testing.assert_allclose(found[:3], tools[:3, 0] + offsets[:3, 0], atol=1e-12)
    turned_tool = np.array(product(half, tuple(tools[3:, 0])))
    np.testing.assert_allclose(found[3:] * math.cos(angle / 2), turned_tool, atol=1e-12)
    np.testing.assert_array_equal(tools, untouched)


GOOD = snapshot().payload
HEADER_BYTES = 8 + int.from_bytes(GOOD[:8], "little")


def refuses_or_reads(payload: bytes) -> None:
    """Whatever the bytes are, nothing but a snapshot or a SnapshotError comes back."""
    with contextlib.suppress(SnapshotError):
        unpack(payload)


@settings(deadline=None)
@given(st.binary(max_size=300))
def test_noise_is_never_worse_than_refused(payload: bytes) -> None:
    refuses_or_reads(payload)


@settings(deadline=None)
@given(
    st.lists(
        st.tuples(st.integers(0, HEADER_BYTES + 64), st.integers(0, 255)), min_size=1, max_size=4
    )
)
def test_a_snapshot_with_some_bytes_changed_is_never_worse_than_refused(
    changes: list[tuple[int, int]],
) -> None:
    payload = bytearray(GOOD)
    for at, value in changes:
        payload[at] = value
    refuses_or_reads(bytes(payload))


JSON: st.SearchStrategy[Any] = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8),
    lambda inner: (
        st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=8), inner, max_size=3)
    ),
    max_leaves=6,
)


@settings(deadline=None)
@given(JSON, st.sampled_from(["card", "tensor", "whole"]), st.binary(max_size=16))
def test_any_header_is_never_worse_than_refused(value: Any, where: str, body: bytes) -> None:
    header: Any = value
    if where == "card":
        header = {"__metadata__": {"card": json.dumps(value)}}
    elif where == "tensor":
        good = json.loads(GOOD[8:HEADER_BYTES])
        header = good | {"log_std": value}
    text = json.dumps(header).encode()
    refuses_or_reads(len(text).to_bytes(8, "little") + text + body)
