"""A joint sticks harder than it slides: by MuJoCo's own LuGre element."""

import mujoco

from shared.sim.hidden.bristles import BEND
from shared.sim.hidden.effect import Case, Hidden, every_joint, share_of_torque
from shared.sim.hidden.robot import Robot

_LEVEL = 1e-3
"""Of the element's own sliding friction, as a share of what it has more at rest."""
_NOTHING = 1e-9
"""Motor constant: MuJoCo wants one (N m/A)."""


def _falloff(case: Case) -> float:
    return (0.04 + 0.1 * float(case.shape[0])) * case.scene.speed(case.place)


def _enter(robot: Robot, case: Case) -> None:
    made = robot.spec.add_actuator(name=f"{case.place} sticks")
    made.trntype = mujoco.mjtTrn.mjTRN_JOINT
    made.target = robot.plant.mj_joint(case.place)
    stiffness = float(case.size) / BEND
    made.set_to_dcmotor(
        motorconst=[_NOTHING, _NOTHING],
        resistance=1.0,
        lugre=[stiffness, 0.02 * stiffness * BEND / _falloff(case), _LEVEL * float(case.size),
               (1.0 + _LEVEL) * float(case.size), _falloff(case)],
    )  # fmt: skip
    made.ctrlspec = mujoco.mjtCtrlInput.mjINPUT_NONE


HIDDEN = Hidden(
    name="stribeck_friction",
    way="MuJoCo's LuGre element",
    places=every_joint,
    sizes=share_of_torque(2e-3, 0.15),
    values=lambda case: {
        "excess": (case.size, "N m"),
        "falloff": (_falloff(case), "rad/s"),
    },
    enter=_enter,
)
