"""A process that shows a recorded bout as robot_io would: 100 ticks a second.

It is started by its path with ENDPOINT RUN FILE as arguments, from the root of the repository.
It shows the bats en garde until the referee says that a bout runs, then the recorded states one by
one, then the bats en garde again; a next bout begins from the start.
"""

import sys
from pathlib import Path

import numpy as np

from shared.bus.config import BusConfig
from shared.bus.zenoh import open_zenoh
from shared.clock import SystemClock
from shared.messages.play import BatStates
from shared.messages.topics import BATS, REFEREE

PERIOD = 0.01


def main() -> None:
    endpoint, run, file = sys.argv[1:]
    recorded = np.load(Path(file))
    first, bats = recorded["first"], recorded["bats"]
    clock = SystemClock()
    bus = open_zenoh(BusConfig(connect=(endpoint,)), "publisher", clock, run)
    referee = bus.subscribe(REFEREE)
    bout, shown, seconds = "", len(bats), 0.0
    tick = 0
    due = clock.now()
    while True:
        while (said := referee.take()) is not None:
            seconds = said.seconds if said.phase == "running" else 0.0
            if said.phase == "running" and said.bout != bout:
                bout, shown = said.bout, 0
        states = BatStates(
            tick=tick, boot=bus.boot, at_ns=clock.wall_ns(),
            bats=bats[shown] if shown < len(bats) else first, tools=np.zeros((2, 7)),
            is_valid=np.ones(2, np.bool_), seconds=seconds,
        )  # fmt: skip
        bus.publish(BATS, states)
        tick, shown = tick + 1, shown + 1
        due = max(due + PERIOD, clock.now())
        while (left := due - clock.now()) > 0.0:
            bus.wait(left)


if __name__ == "__main__":
    main()
