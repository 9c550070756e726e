"""Whatever bytes come over a ROS connection, they are a message, a header, or refused."""

import contextlib

from hypothesis import example, given
from hypothesis import strategies as st

from shared.errors import MessageError
from shared.ros import types
from shared.ros.wire import fields_of, header

NAMES = (
    "robot_mechanism_controllers/JTCartesianControllerState", "sensor_msgs/JointState",
    "diagnostic_msgs/DiagnosticArray", "pr2_msgs/PowerBoardState",
    "pr2_mechanism_msgs/ListControllersResponse", "std_msgs/Bool",
)  # fmt: skip


@given(st.sampled_from(NAMES), st.binary(max_size=300))
@example("sensor_msgs/JointState", b"\xff" * 40)
def test_any_bytes_are_a_message_or_refused(name: str, data: bytes) -> None:
    with contextlib.suppress(MessageError):
        assert types.read(name, data).__msgtype__


@given(st.sampled_from(NAMES), st.integers(0, 400), st.integers(0, 255))
def test_a_damaged_message_is_a_message_or_refused(name: str, place: int, byte: int) -> None:
    data = bytearray(types.write(types.new(name)))
    data[place % len(data)] = byte
    with contextlib.suppress(MessageError):
        types.read(name, bytes(data))


@given(st.binary(max_size=200))
@example(b"\x04\x00\x00\x00=abc")
@example(b"\xff\xff\xff\xffa=b")
def test_any_bytes_are_a_header_or_refused(data: bytes) -> None:
    with contextlib.suppress(MessageError):
        fields_of(data)


word = st.text(st.characters(blacklist_characters="=", blacklist_categories=("Cs",)), min_size=1)


@given(st.dictionaries(word, st.text(st.characters(blacklist_categories=("Cs",)))))
def test_a_header_reads_back(fields: dict[str, str]) -> None:
    assert fields_of(header(fields)[4:]) == fields
