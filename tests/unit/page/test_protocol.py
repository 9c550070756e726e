import math
import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from services.page.protocol import (
    BoutAsk,
    GateAsk,
    PlayerAsk,
    Pointer,
    StatsAsk,
    parse_ask,
    parse_pointer,
)
from shared.errors import MessageError


def pose(*numbers: float) -> bytes:
    return struct.pack(f"<{len(numbers)}d", *numbers)


def test_six_numbers_are_a_pose():
    found = parse_pointer(pose(4, 0.1, -0.2, 1.3, 0.5, 1), session=2, last=3)
    assert found == Pointer(session=2, sequence=4, tip=(0.1, -0.2, 1.3), roll=0.5, is_valid=True)


def test_a_roll_is_brought_within_one_turn():
    assert parse_pointer(pose(0, 0, 0, 1, 7 * math.pi / 2, 1), 1, -1).roll == pytest.approx(
        -math.pi / 2
    )


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"", "a pose has 0 bytes, expected 48 (6 float64)"),
        (pose(0, 1, 2, 3, 4), "has 40 bytes"),
        (pose(0, math.nan, 0, 1, 0, 1), "x of a pose is nan, expected a finite number"),
        (pose(0, 0, math.inf, 1, 0, 1), "y of a pose is inf"),
        (pose(0, 0, 0, 1, -math.inf, 1), "roll of a pose is -inf"),
        (pose(7, 0, 0, 1, 0, 1), "sequence of a pose is 7, expected a count above 7"),
        (pose(8.5, 0, 0, 1, 0, 1), "sequence of a pose is 8.5"),
        (pose(2.0**53, 0, 0, 1, 0, 1), "expected a count above 7"),
        (pose(8, 0, 0, 101, 0, 1), "a pose is at 0, 0, 101 m, expected within 100 m"),
        (pose(8, 0, 0, 1, 0, 2), "is_valid of a pose is 2, expected 0 or 1"),
    ],
)
def test_what_is_no_pose_is_refused_with_the_number_that_is_wrong(data: bytes, message: str):
    with pytest.raises(MessageError) as caught:
        parse_pointer(data, session=1, last=7)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


@given(st.binary(max_size=64))
def test_any_bytes_are_a_sound_pose_or_refused(data: bytes):
    try:
        found = parse_pointer(data, session=1, last=-1)
    except MessageError:
        return
    assert all(map(math.isfinite, (*found.tip, found.roll)))
    assert max(map(abs, found.tip)) <= 100.0
    assert abs(found.roll) <= math.pi


@pytest.mark.parametrize(
    ("text", "ask"),
    [
        ('{"type":"bout","action":"start"}', BoutAsk("start")),
        ('{"type":"gate","action":"arm"}', GateAsk("arm")),
        ('{"type":"player","name":"Guard"}', PlayerAsk("Guard")),
        (
            '{"type":"stats","frames_per_s":60,"latency_p50_ms":8.5,"latency_p90_ms":12}',
            StatsAsk(60.0, 8.5, 12.0),
        ),
    ],
)
def test_a_wish_is_read(text: str, ask: object):
    assert parse_ask(text) == ask


@pytest.mark.parametrize(
    "text",
    [
        "", "arm", "[]", "{}", '{"type":"gate"}', '{"type":"gate","action":"open"}',
        '{"type":"bout","action":"start","bout":"mine"}', '{"type":"player","name":3}',
        '{"type":"stats","frames_per_s":-1,"latency_p50_ms":0,"latency_p90_ms":0}',
        '{"type":"stats","frames_per_s":1e300,"latency_p50_ms":0,"latency_p90_ms":0}',
        "[" * 1000,
    ],
)  # fmt: skip
def test_what_is_no_wish_is_refused_in_one_line(text: str):
    with pytest.raises(MessageError) as caught:
        parse_ask(text)
    assert "\n" not in str(caught.value)
