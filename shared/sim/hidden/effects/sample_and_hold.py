"""The controller takes a new command only at intervals: a latch in its loop."""

import math
from collections.abc import Callable

from shared.sim.arm import Float64
from shared.sim.hidden.effect import Case, Hidden, whole_arm
from shared.sim.hidden.robot import Robot


def _enter(robot: Robot, case: Case) -> None:
    robot.holds.append(lambda: _latch(case, robot.timestep))


def _latch(case: Case, timestep: float) -> Callable[[float, Float64], Float64]:
    """Return what holds a command; a turn within a step counts for what is left of the step."""
    late = float(case.shape[0])
    turn, held = -math.inf, None

    def hold(time: float, wanted: Float64) -> Float64:
        nonlocal turn, held
        end = time + timestep
        now = math.floor(end / case.size - late)
        if now == turn and held is not None:
            return held
        before = wanted if held is None else held
        turn, held = now, wanted
        share = min((end - case.size * (now + late)) / timestep, 1.0)
        return before + share * (wanted - before)

    return hold


HIDDEN = Hidden(
    name="sample_and_hold",
    way="a latch in the loop, which begins to count at any time",
    places=whole_arm,
    sizes=lambda scene, place: (0.012, 0.15),
    values=lambda case: {"period": (case.size, "s"), "phase": (float(case.shape[0]), "1")},
    enter=_enter,
)
