"""A policy process for the tests: slowly up and down, for as long as it lives."""

import math
import sys

import numpy as np

from shared.bus.config import BusConfig
from shared.bus.zenoh import open_zenoh
from shared.clock import SystemClock
from shared.messages.play import DesiredOffset
from shared.messages.topics import BATS, OFFSET


def main(endpoint: str) -> None:
    bus = open_zenoh(BusConfig(connect=(endpoint,)), "policy", SystemClock(), "live")
    bats = bus.subscribe(BATS)
    while True:
        bus.wait(1.0)
        states = None
        while (newer := bats.take()) is not None:
            states = newer
        if states is None:
            continue
        offset = np.zeros(6)
        offset[2] = 0.03 * math.copysign(1.0, math.sin(2 * math.pi * states.tick / 100))
        answer = DesiredOffset(
            agent="protagonist", tick=states.tick, boot=states.boot, snapshot="moving",
            offset=offset, took_ms=0.0,
        )  # fmt: skip
        bus.publish(OFFSET, answer, agent="protagonist")


main(sys.argv[1])
