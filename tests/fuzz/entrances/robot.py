"""What comes from a robot, its sensors and a browser: ROS, Vive, heart rate, the page."""

import asyncio
import struct
from collections.abc import Callable
from pathlib import Path
from random import Random
from typing import Any

from services.page.protocol import parse_ask, parse_pointer
from services.robot_io.heart_rate.packet import parse
from services.robot_io.vive.poller import POSE, unpacked
from shared.errors import MessageError
from shared.ros import types, wire, xmlrpc
from shared.ros.definitions import MESSAGES, SERVICES
from shared.ros.errors import RosError
from shared.ros.subscribing import _Reader
from tests.fuzz import formats, mutate
from tests.fuzz.target import MIB, Bound, Target

SMALL = Bound(64, 8 * MIB)
LARGE = Bound(64, 64 * MIB)
"""Of a ROS message: a count that is believed may take one array of the longest length."""
STANDARD = (
    "sensor_msgs/JointState", "geometry_msgs/PoseStamped", "geometry_msgs/TwistStamped",
    "std_msgs/Float64", "std_msgs/String", "diagnostic_msgs/DiagnosticArray", "tf2_msgs/TFMessage",
    "trajectory_msgs/JointTrajectory",
)  # fmt: skip
METHODS: dict[str, xmlrpc.Method] = {
    "publisherUpdate": lambda caller, topic, uris: [1, str(caller), len(topic) + len(uris)],
    "requestTopic": lambda caller, topic, kinds: [1, "", ["TCPROS", "127.0.0.1", 1]],
    "getPid": lambda caller: [1, "", 1],
}
ASKS = (
    b'{"type": "bout", "action": "start"}', b'{"type": "player", "name": "style-1"}',
    b'{"type": "stats", "frames_per_s": 60.0, "latency_p50_ms": 1.0, "latency_p90_ms": 2.0}',
    b'{"type": "gate", "action": "arm"}',
)  # fmt: skip


def targets(_: Path) -> list[Target]:
    """Return all of them."""
    return [*_ros_messages(), *_ros_connections(), *_sensors(), *_page()]


def _ros_messages() -> list[Target]:
    known = [name for name in STANDARD if _is_known(name)]
    names = [*MESSAGES, *known, *(f"{name}{half}" for name in SERVICES
                                  for half in ("Request", "Response"))]  # fmt: skip
    return [
        Target(
            name=f"robot/ros/{name}",
            read=_reader_of(name),
            samples=(types.write(types.new(name)), *_full(name)),
            mutate=mutate.raw,
            refusals=(MessageError,),
            covers=("shared.ros.types:read",),
            bound=LARGE,
        )
        for name in names
    ]


def _is_known(name: str) -> bool:
    try:
        types.md5_of(name)
    except ValueError:
        return False
    return True


def _full(name: str) -> tuple[bytes, ...]:
    """Return one with something in its arrays, where it is easily made."""
    if name == "sensor_msgs/JointState":
        import numpy as np

        numbers = np.arange(20.0)
        made = types.new(name, name=[f"joint_{k}" for k in range(20)], position=numbers,
                         velocity=numbers, effort=numbers)  # fmt: skip
        return (types.write(made),)
    return ()


def _reader_of(name: str) -> Callable[[bytes], object]:
    return lambda data: types.read(name, data)


def _ros_connections() -> list[Target]:
    greeting = wire.header({"callerid": "/robot", "topic": "/joint_states", "md5sum": "*",
                            "type": "sensor_msgs/JointState"})  # fmt: skip
    calls = (("publisherUpdate", ("/master", "/joints", ["http://a:1", "http://b:2"])),
             ("requestTopic", ("/me", "/joints", [["TCPROS"]])), ("getPid", ("/me",)))  # fmt: skip
    xml = tuple(xmlrpc.xmlrpc.client.dumps(words, name).encode() for name, words in calls)
    server = xmlrpc.XmlRpcServer(METHODS)
    http = tuple(
        b"POST /RPC2 HTTP/1.1\r\nContent-Type: text/xml\r\nContent-Length: %d\r\n\r\n" % len(each)
        + each for each in xml
    )  # fmt: skip
    uris = (b"http://pr2:11311", b"rosrpc://10.0.0.1:4000", b"http://[::1]:80/x")
    return [
        Target("robot/ros/header", wire.fields_of, (greeting[4:],), _lengths, (MessageError,),
               ("shared.ros.wire:fields_of", "shared.ros.wire:length_of"), SMALL),
        Target("robot/ros/stream", _stream, (greeting + wire.framed(bytes(16)) * 3,), _lengths,
               (MessageError,), ("shared.ros.subscribing:_Reader.data_received",), LARGE),
        Target("robot/ros/xml", server._answer, xml, mutate.raw, (MessageError,),
               ("shared.ros.xmlrpc:_decoded",), Bound(256, 16 * MIB)),
        Target("robot/ros/http", _http, http, mutate.raw,
               (MessageError, EOFError, asyncio.LimitOverrunError),
               ("shared.ros.xmlrpc:_head", "shared.ros.xmlrpc:_body"), Bound(256, 16 * MIB)),
        Target("robot/ros/uri", lambda data: xmlrpc.place_of(data.decode("utf-8", "replace")), uris,
               mutate.raw, (RosError,), ("shared.ros.xmlrpc:place_of",), SMALL),
    ]  # fmt: skip


def _lengths(random: Random, data: bytes) -> bytes:
    """Break bytes in which every part has its length in front, the lengths most of all."""
    if random.random() < 0.5:
        return mutate.raw(random, data)
    at = 0
    for _ in range(random.randrange(4)):
        if at + 4 > len(data):
            break
        at += 4 + int.from_bytes(data[at : at + 4], "little")
    length = struct.pack("<I", random.choice(mutate.NUMBERS) & 0xFFFFFFFF)
    return data[:at] + length + data[at + 4 :]


class _Publisher:
    """What ``_Reader`` knows of its subscription: limits, a check of the header, a place."""

    largest = wire.LARGEST_MESSAGE
    malformed = 0

    def greet(self, fields: dict[str, str]) -> None:
        if "md5sum" not in fields:
            raise MessageError("no md5sum")

    def keep(self, data: bytes) -> None:
        types.read("std_msgs/Header", data)


async def _receive(data: bytes) -> None:
    subscription: Any = _Publisher()
    reader = _Reader(subscription)
    try:
        for start in range(0, len(data), 1400):  # as TCP brings it
            reader.data_received(data[start : start + 1400])
    finally:
        futures = [each for each in (reader.greeted, reader.ended) if each.done()]
        errors = [error for each in futures if (error := each.exception())]
        if errors:
            raise errors[0]


def _stream(data: bytes) -> None:
    loop().run_until_complete(_receive(data))


async def _ask(data: bytes) -> None:
    reader = asyncio.StreamReader(limit=16 << 10)
    reader.feed_data(data)
    reader.feed_eof()
    _, fields = await xmlrpc._head(reader)
    await xmlrpc._body(reader, fields)


def _http(data: bytes) -> None:
    loop().run_until_complete(_ask(data))


_LOOPS: list[asyncio.AbstractEventLoop] = []


def loop() -> asyncio.AbstractEventLoop:
    """Return this process's loop, made the first time."""
    if not _LOOPS:
        _LOOPS.append(asyncio.new_event_loop())
    return _LOOPS[0]


def _sensors() -> list[Target]:
    pose = POSE.pack(1.0, 0.1, 0.2, 0.3, 1.0, 0.0, 0.0, 0.0)
    report = (b'{"status": {"problem": ""}, "counters": {"tracker_polls": 3}}',)
    return [
        Target("robot/heart_rate", parse, (b"\x00\x48", b"\x16\x48\x00\x04\x00\x04",
               b"\x1d\x48\x00\x10\x00\x00\x04"), mutate.raw, (MessageError,),
               ("services.robot_io.heart_rate.packet:parse",), SMALL),
        Target("robot/vive/pose", unpacked, (pose,), mutate.raw, (),
               ("services.robot_io.vive.poller:unpacked",), SMALL),
        Target("robot/vive/report", unpacked, report, formats.json_text, (),
               ("services.robot_io.vive.poller:unpacked",), SMALL),
    ]  # fmt: skip


def _page() -> list[Target]:
    poses = tuple(struct.pack("<6d", k, 0.1 * k, 0.2, 0.3, 1.0, k % 2) for k in range(4))

    def ask(data: bytes) -> object:
        return parse_ask(data.decode("utf-8", "replace"))

    return [
        Target("robot/page/pointer", lambda data: parse_pointer(data, 1, -1), poses, _floats,
               (MessageError,), ("services.page.protocol:parse_pointer",), SMALL),
        Target("robot/page/ask", ask, ASKS, formats.json_text, (MessageError,),
               ("services.page.protocol:parse_ask",), SMALL),
    ]  # fmt: skip


def _floats(random: Random, data: bytes) -> bytes:
    """Put a float that is none, or a strange one, into an array of float64."""
    if random.random() < 0.4 or len(data) < 8:
        return mutate.raw(random, data)
    at = 8 * random.randrange(len(data) // 8)
    odd = random.choice(
        (float("nan"), float("inf"), -1.0, 2.0**53, 2.0**63, 1e308, -0.0, 0.5, 101.0)
    )
    return data[:at] + struct.pack("<d", odd) + data[at + 8 :]
