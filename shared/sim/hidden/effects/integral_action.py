"""The controller integrates its error: a sum that it adds to what it gives, from its start on."""

import numpy as np

from shared.sim.hidden.effect import Case, Hidden, servos
from shared.sim.hidden.robot import Law, Moment, Robot


def _enter(robot: Robot, case: Case) -> None:
    robot.drives.append(lambda: _integrating(case))


def _integrating(case: Case) -> Law:
    joints = case.scene.joints
    own = [joints.index(case.place)] if case.place else list(range(len(joints)))
    total = np.zeros(len(own))
    error_before = np.zeros(len(own))

    def act(moment: Moment) -> None:
        nonlocal total, error_before
        servo = -moment.model.actuator_biasprm[own]
        speed = moment.data.qvel[moment.dofs[own]]
        error = (moment.drive[own] + servo[:, 2] * speed) / servo[:, 1]
        total = total + 0.5 * moment.timestep * (error + error_before)
        error_before = error
        moment.drive[own] += case.size * servo[:, 1] * total

    return act


HIDDEN = Hidden(
    name="integral_action",
    way="a sum of errors in the servo, from when it was switched on",
    places=servos,
    sizes=lambda scene, place: (0.5, 8.0),
    values=lambda case: {"rate": (case.size, "1/s")},
    enter=_enter,
)
