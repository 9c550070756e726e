"""Servos leave out a band around their commands: the torque of the error that is within it."""

from shared.sim.hidden.effect import Case, Hidden, servos
from shared.sim.hidden.robot import Law, Moment, Robot


def _enter(robot: Robot, case: Case) -> None:
    robot.drives.append(lambda: _leaving_out(case))


def _leaving_out(case: Case) -> Law:
    joints = case.scene.joints
    own = [joints.index(case.place)] if case.place else list(range(len(joints)))

    def act(moment: Moment) -> None:
        servo = -moment.model.actuator_biasprm[own]
        speed = moment.data.qvel[moment.dofs[own]]
        error = (moment.drive[own] + servo[:, 2] * speed) / servo[:, 1]
        moment.drive[own] -= servo[:, 1] * error.clip(-case.size, case.size)

    return act


HIDDEN = Hidden(
    name="dead_band",
    way="taken off the error in the servo, in the same step",
    places=servos,
    sizes=lambda scene, place: (2e-3, 0.05),
    values=lambda case: {"half_band": (case.size, "rad")},
    enter=_enter,
)
