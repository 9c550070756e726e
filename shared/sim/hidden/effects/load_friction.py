"""A gear's friction grows with the load on it: as bristles."""

from shared.sim.hidden.bristles import Bristles
from shared.sim.hidden.effect import Case, Hidden, dof_of, every_joint
from shared.sim.hidden.robot import Law, Moment, Robot


def _enter(robot: Robot, case: Case) -> None:
    robot.laws.append(lambda: _rub(robot, case))


def _rub(robot: Robot, case: Case) -> Law:
    bristles = Bristles()
    joint = case.scene.joints.index(case.place)
    before = 0.0

    def act(moment: Moment) -> None:
        nonlocal before
        dof = dof_of(robot, moment.model, case.place)
        speed = float(moment.data.qvel[dof])
        rotor = float(moment.model.dof_armature[dof]) * (speed - before) / moment.timestep
        before = speed
        level = case.size * abs(float(moment.drive[joint]) - rotor)
        moment.data.qfrc_applied[dof] += bristles.torque(level, speed, moment.timestep)

    return act


HIDDEN = Hidden(
    name="load_friction",
    way="bristles, not a constraint",
    places=every_joint,
    sizes=lambda scene, place: (5e-3, 0.4),
    values=lambda case: {"share": (case.size, "1")},
    enter=_enter,
)
