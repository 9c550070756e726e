"""Readings and commands are lost while the link is down; the size is how long."""

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
    lengths = case.size * rng.uniform(0.7, 1.3, count)
    return list(zip(begins.tolist(), (begins + lengths).tolist(), strict=True))


def _enter(robot: Robot, case: Case) -> None:
    outages = _outages(case)
    robot.outages += outages

    def lose(command: Signal) -> Signal:
        down = np.zeros(len(command.at), np.bool_)
        for begin, end in outages:
            down |= (command.at >= begin) & (command.at < end)
        return Signal(command.at[~down], command.values[~down])

    robot.commands.append(lose)


HIDDEN = Hidden(
    name="dropped_packets",
    way="packets that are not there",
    places=whole_arm,
    sizes=lambda scene, place: (0.06, 0.3),
    values=lambda case: {"share": (1.0, "1")},
    enter=_enter,
)
