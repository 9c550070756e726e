"""A policy process for these tests: answers every tick, in the way its first argument says.

Several ways, with commas between, are one after the other; SIGUSR1 goes on to the next.
"""

import math
import signal
import sys

import numpy as np

from shared.bus.config import BusConfig
from shared.bus.zenoh import open_zenoh
from shared.clock import SystemClock
from shared.messages.play import DesiredOffset
from shared.messages.topics import BATS, OFFSET

REACH = 0.0375
"""Of a real policy's offset (m)."""


def offset_of(kind: str, tick: int) -> np.ndarray:
    out = np.zeros(6)
    up = math.copysign(1.0, math.sin(2.0 * math.pi * tick / 100))
    if kind == "moving":
        out[2] = REACH * up
    elif kind == "nan":
        out[:] = math.nan
    elif kind == "jumping":  # metres away, elsewhere each time
        out[:3] = 3.0 * math.sin(17.0 * tick), 5.0 * up, 0.4 * math.cos(5.0 * tick)
    elif kind == "wild":  # as far as it may be and further, everywhere
        out[:3] = 0.15 * math.sin(0.31 * tick), 0.2 * up, 0.2 * math.cos(0.17 * tick)
        out[3:] = 0.5 * math.sin(0.11 * tick)
    elif kind == "outward":  # always out of the box and at the person
        out[:3] = 0.1, -0.1, 0.1
    return out


def main(kinds: str, endpoint: str) -> None:
    ways = kinds.split(",")
    signal.signal(signal.SIGUSR1, lambda *_: ways.pop(0))
    bus = open_zenoh(BusConfig(connect=(endpoint,)), "policy", SystemClock(), "live")
    bats = bus.subscribe(BATS)
    while True:
        bus.wait(1.0)
        states = None
        while (newer := bats.take()) is not None:
            states = newer
        kind = ways[0]
        if states is None or kind == "silent":
            continue
        answer = DesiredOffset(
            agent="protagonist", tick=states.tick, boot=states.boot, snapshot=kind,
            offset=offset_of(kind, states.tick), took_ms=0.0,
        )  # fmt: skip
        bus.publish(OFFSET, answer, agent="protagonist")


main(*sys.argv[1:])
