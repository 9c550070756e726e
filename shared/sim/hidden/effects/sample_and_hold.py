"""The controller takes a new command only at intervals: a latch in its loop."""

import math
from collections.abc import Callable

from shared.sim.arm import Float64
from shared.sim.hidden.effect import Case, Hidden, whole_arm
from shared.sim.hidden.robot import Robot


def _enter(robot: Robot, case: Case) -> None:
    robot.holds.append(lambda: _latch(case))


def _latch(case: Case) -> Callable[[float, Float64], Float64]:
    late = float(case.shape[0])
    turn, held = -math.inf, None

    def hold(time: float, wanted: Float64) -> Float64:
        nonlocal turn, held
        now = math.floor(time / case.size - late + 1e-9)
        if now != turn or held is None:
            turn, held = now, wanted
        return held

    return hold


HIDDEN = Hidden(
    name="sample_and_hold",
    way="a latch in the loop, which begins to count at any time",
    places=whole_arm,
    sizes=lambda scene, place: (0.012, 0.15),
    values=lambda case: {"period": (case.size, "s"), "phase": (float(case.shape[0]), "1")},
    enter=_enter,
)
