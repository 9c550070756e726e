"""Bags of ROS 1 and ROS 2: which topics one has, and the messages of some."""

# pyright: basic
# (bags bring message types of their own)

import contextlib
import struct
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import apsw
import numpy as np
from rosbags.highlevel import AnyReader, AnyReaderError
from rosbags.rosbag1 import ReaderError as Reader1Error
from rosbags.rosbag2 import ReaderError as Reader2Error
from rosbags.rosbag2.reader import zstd  # whichever this Python has
from rosbags.serde import SerdeError
from rosbags.typesys import Stores, TypesysError, get_typestore

from shared.errors import RiposteError
from shared.ros.types import LONGEST_ARRAY

MAX_MESSAGES: Final = 2_000_000
"""Of the topics asked for, in one bag."""
_TROUBLE: Final = (
    AnyReaderError, Reader1Error, Reader2Error, SerdeError, TypesysError, OSError, EOFError,
    ValueError, KeyError, IndexError, TypeError, AttributeError, AssertionError, OverflowError,
    MemoryError, RuntimeError, struct.error, apsw.Error, zstd.ZstdError,
)  # fmt: skip
"""What a damaged bag makes the readers raise."""


@dataclass(frozen=True)
class Topic:
    """One topic of a bag."""

    name: str
    type: str
    """As ROS 1 names it: ``sensor_msgs/JointState``."""
    received_ns: np.ndarray[Any, np.dtype[np.int64]]
    """int64[N], when each message was written into the bag."""
    messages: tuple[Any, ...]
    """N messages."""


def topics_of(path: Path) -> dict[str, str]:
    """Return the types of a bag's topics by name, as ROS 1 names them.

    Raises:
        RiposteError: it is no bag, or damaged.
    """
    with _opened(path) as reader:
        return {each.topic: _short(each.msgtype) for each in reader.connections}


def read_topics(path: Path, names: Collection[str]) -> dict[str, Topic]:
    """Return the messages of some topics, those that the bag has.

    Args:
        path: a ``.bag`` file, or the folder (or ``.mcap`` or ``.db3`` file) of a ROS 2 bag.
        names: of the topics.

    Raises:
        RiposteError: it is no bag, damaged, or has too many messages of these topics.
    """
    with _opened(path) as reader:
        chosen = [each for each in reader.connections if each.topic in names]
        count = sum(each.msgcount for each in chosen)
        if count > MAX_MESSAGES:
            raise RiposteError(
                f"{path} has {count} messages of {', '.join(sorted(set(names)))}, at most "
                f"{MAX_MESSAGES} are read: cut it with rosbag filter"
            )
        found: dict[str, tuple[str, list[int], list[Any]]] = {
            each.topic: (_short(each.msgtype), [], []) for each in chosen
        }
        if chosen:
            for connection, received, data in reader.messages(connections=chosen):
                _, times, messages = found[connection.topic]
                times.append(received)
                messages.append(reader.deserialize(data, connection.msgtype))
    return {
        name: Topic(name, kind, np.array(times, np.int64), tuple(messages))
        for name, (kind, times, messages) in found.items()
    }


@contextlib.contextmanager
def _opened(path: Path) -> Iterator[AnyReader]:
    """Open a bag, and say what goes wrong with it in one line."""
    if not path.exists():
        raise RiposteError(f"there is no bag {path}")
    try:
        # bags of ROS 2 before Iron do not say what their types are
        store = get_typestore(Stores.ROS2_HUMBLE)
        with AnyReader([path], default_typestore=store) as reader:
            reader.typestore.max_sequence_length = LONGEST_ARRAY
            yield reader
    except RiposteError:
        raise
    except _TROUBLE as error:
        text = " ".join(str(error).split())[:300] or type(error).__name__
        raise RiposteError(
            f"{path} is no bag of ROS 1 (.bag) or ROS 2 (its folder), or damaged ({text})"
        ) from None


def _short(name: str) -> str:
    return name.replace("/msg/", "/")
