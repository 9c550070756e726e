"""A joint's torque ripples with its position: by MuJoCo's own motor."""

import math

import mujoco

from shared.sim.hidden.effect import Case, Hidden, every_joint, share_of_torque
from shared.sim.hidden.robot import Robot

_LEAST, _MOST = 3.0, 10.0
"""Ripples in a joint's travel."""
_NOTHING = 1e-9
"""Motor constant: MuJoCo wants one (N m/A)."""


def _ripples(case: Case) -> int:
    """Return how many a turn, as magnets are."""
    in_travel = _LEAST + (_MOST - _LEAST) * float(case.shape[0])
    return round(in_travel * 2.0 * math.pi / (2.0 * case.scene.reach(case.place)))


def _phase(case: Case) -> float:
    return 2.0 * math.pi * float(case.shape[1])


def _enter(robot: Robot, case: Case) -> None:
    made = robot.spec.add_actuator(name=f"{case.place} cogs")
    made.trntype = mujoco.mjtTrn.mjTRN_JOINT
    made.target = robot.plant.mj_joint(case.place)
    made.set_to_dcmotor(
        motorconst=[_NOTHING, _NOTHING], resistance=1.0,
        cogging=[float(case.size), float(_ripples(case)), _phase(case)],
    )  # fmt: skip
    made.ctrlspec = mujoco.mjtCtrlInput.mjINPUT_NONE


HIDDEN = Hidden(
    name="cogging",
    way="MuJoCo's cogging of a motor",
    places=every_joint,
    sizes=share_of_torque(2e-3, 0.15),
    values=lambda case: {  # size sin(n q + phase)
        "cosine": (case.size * math.sin(_phase(case)), "N m"),
        "sine": (case.size * math.cos(_phase(case)), "N m"),
        "ripples": (float(_ripples(case)), "1/turn"),
    },
    enter=_enter,
)
