"""Commands are lost while the link is down, and so are readings: each packet by itself."""

import numpy as np

from shared.sim.hidden.effect import Case, Hidden, whole_arm
from shared.sim.hidden.robot import Robot
from shared.sim.plant.signals import Signal

_EVERY = 1.0
"""Seconds to an outage."""


def _outages(case: Case) -> list[tuple[float, float]]:
    """Return from when to when the link is down (s)."""
    rng = np.random.default_rng((1e6 * case.shape).astype(np.int64))
    count = int(case.scene.duration / _EVERY) - 1
    begins = 0.5 * _EVERY + _EVERY * (np.arange(count) + rng.uniform(0.0, 0.7, count))
    return [(float(begin), float(begin + rng.uniform(0.08, 0.25))) for begin in begins]


def _enter(robot: Robot, case: Case) -> None:
    outages = _outages(case)
    robot.outages += outages
    rng = np.random.default_rng((1e6 * case.shape).astype(np.int64) + 1)

    def lose(command: Signal) -> Signal:
        down = np.zeros(len(command.at), np.bool_)
        for begin, end in outages:
            down |= (command.at >= begin) & (command.at < end)
        lost = down & (rng.uniform(size=len(down)) < case.size)
        return Signal(command.at[~lost], command.values[~lost])

    robot.commands.append(lose)


HIDDEN = Hidden(
    name="dropped_packets",
    way="each packet is lost or not",
    places=whole_arm,
    sizes=lambda scene, place: (0.3, 1.0),
    values=lambda case: {"share": (case.size, "1")},
    enter=_enter,
)
