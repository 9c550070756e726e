"""What a lying policy sends: what the wire refuses, and what gets as far as robot_io."""

import msgspec
import numpy as np
import pytest

from services.jobs.chaos.robot.lies import LIES, damaged
from shared.errors import MessageError
from shared.messages.play import DesiredOffset
from shared.messages.topics import OFFSET
from shared.messages.wire import decode, encode

TRUE = DesiredOffset(
    agent="protagonist", tick=700, boot="b" * 12, snapshot="scripted:heuristic",
    offset=np.zeros(6), took_ms=0.1,
)  # fmt: skip
ON_THE_WIRE = {"not a number", "infinite", "damaged bytes", "huge"}


def arrives(lie: str) -> DesiredOffset:
    payload = encode(LIES[lie](TRUE))
    payload = damaged(payload) if lie == "damaged bytes" else payload
    return decode(DesiredOffset, payload, OFFSET.max_bytes)


@pytest.mark.parametrize("lie", sorted(ON_THE_WIRE))
def test_what_is_broken_does_not_get_past_the_wire(lie: str):
    with pytest.raises(MessageError):
        arrives(lie)


@pytest.mark.parametrize("lie", sorted(LIES.keys() - ON_THE_WIRE))
def test_what_is_false_gets_to_robot_io(lie: str):
    found = arrives(lie)
    same = all(
        np.array_equal(getattr(found, name), getattr(TRUE, name))
        for name in DesiredOffset.__struct_fields__
    )
    assert same == (lie == "sent again")


def test_to_and_fro_goes_the_other_way_with_every_tick():
    offsets = [LIES["to and fro"](TRUE).offset, LIES["to and fro"](_next(TRUE)).offset]
    assert offsets[0] == pytest.approx(-offsets[1])
    assert abs(offsets[0]).max() > 0.03


def _next(answer: DesiredOffset) -> DesiredOffset:
    return msgspec.structs.replace(answer, tick=answer.tick + 1)
