"""The controller takes a new command only at intervals: a latch in its loop."""

import math

import numpy as np

from shared.sim.arm import Float64
from shared.sim.hidden.effect import Case, Hidden, whole_arm
from shared.sim.hidden.robot import Hold, Robot
from shared.sim.plant.signals import Signal


def _enter(robot: Robot, case: Case) -> None:
    robot.hold = lambda: _latch(case, robot.timestep)


def _latch(case: Case, timestep: float) -> Hold:
    """Return what holds a command; a turn within a step counts for what is left of the step."""
    late = float(case.shape[0])
    turn, held = -math.inf, None

    def hold(time: float, command: Signal) -> Float64:
        nonlocal turn, held
        end = time + timestep
        now = math.floor(end / case.size - late)
        if now == turn and held is not None:
            return held
        begun = case.size * (now + late)
        taken = command.held(np.array([begun]))[0]
        before = taken if held is None else held
        turn, held = now, taken
        share = min((end - begun) / timestep, 1.0)
        return before + share * (taken - before)

    return hold


HIDDEN = Hidden(
    name="sample_and_hold",
    way="a latch in the loop, which begins to count at any time",
    places=whole_arm,
    sizes=lambda scene, place: (0.012, 0.15),
    values=lambda case: {"period": (case.size, "s"), "phase": (float(case.shape[0]), "1")},
    enter=_enter,
)
