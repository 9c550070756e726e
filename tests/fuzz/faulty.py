"""Readers that break every promise, so that the campaign can be seen to notice."""

import contextlib
import os
import pickle  # noqa: TID251 - the point of this reader
import time
from pathlib import Path
from random import Random

from tests.fuzz.registry import Group
from tests.fuzz.target import MIB, Bound, Target

GROUPS = tuple(
    Group(name, "breaks a promise", f"tests.fuzz.faulty:{name}", 1)
    for name in ("escaped", "memory", "acted", "wrote", "crashed", "hung", "slow")
)
PICKLED = pickle.dumps(print)
AT = 5
"""Number of the input that is refused in the wrong way."""


def _target(name: str, deed: object) -> list[Target]:
    def read(data: bytes) -> None:
        if data == b"%d" % AT:
            deed()  # type: ignore[operator]
        raise ValueError(data)

    def numbered(random: Random, data: bytes) -> bytes:
        return b"5" if random.random() < 0.3 else data

    return [Target(f"{name}/it", read, (b"0",), numbered, (ValueError,), (), Bound(1, 8 * MIB))]


def escaped(_: Path) -> list[Target]:
    return _target("escaped", lambda: {}["no such key"])


def memory(_: Path) -> list[Target]:
    return _target("memory", lambda: bytearray(64 * MIB))


def acted(_: Path) -> list[Target]:
    return _target("acted", lambda: pickle.loads(PICKLED))


def wrote(_: Path) -> list[Target]:
    def write() -> None:
        with contextlib.suppress(OSError):  # there is no such folder; the attempt is enough
            Path("/no/such/folder").write_bytes(b"")

    return _target("wrote", write)


def crashed(_: Path) -> list[Target]:
    return _target("crashed", os.abort)


def hung(_: Path) -> list[Target]:
    return _target("hung", lambda: time.sleep(1000.0))


def slow(_: Path) -> list[Target]:
    def busy() -> None:
        until = time.process_time() + 2.2
        while time.process_time() < until:
            pass

    return _target("slow", busy)
