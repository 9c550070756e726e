"""The tool is heavier than the model says: a body of its own is welded to it."""

import numpy as np

from shared.sim.hidden.effect import Case, Hidden, whole_arm
from shared.sim.hidden.robot import Law, Moment, Robot

_GRAVITY = 9.81
"""(m/s^2)."""
_NAME = "payload"


def _enter(robot: Robot, case: Case) -> None:
    tool = robot.spec.body(robot.plant.tool_body)
    share = case.size / float(tool.mass)
    made = tool.add_body(name=_NAME, pos=np.array(tool.ipos, np.float64))
    made.explicitinertial = True
    made.mass = case.size
    made.ipos = [0.0, 0.0, 0.0]
    full = np.asarray(tool.fullinertia, np.float64)
    if np.isfinite(full[0]):
        made.fullinertia = share * full
    else:
        made.inertia, made.iquat = share * np.asarray(tool.inertia), tool.iquat
    if robot.plant.control == "pose":  # the arm is counterbalanced, what was added is not
        robot.laws.append(lambda: _weight(case.size))


def _weight(mass: float) -> Law:
    def pull(moment: Moment) -> None:
        moment.data.xfrc_applied[moment.model.body(_NAME).id, 2] -= mass * _GRAVITY

    return pull


HIDDEN = Hidden(
    name="payload",
    way="an added body; where the arm is counterbalanced its weight is a force",
    places=whole_arm,
    sizes=lambda scene, place: (5e-3, 1.5),
    values=lambda case: {"mass": (case.size, "kg")},
    enter=_enter,
)
