"""A joint whose model has no dry friction rubs: as bristles."""

from shared.sim.hidden.bristles import Bristles
from shared.sim.hidden.effect import Case, Hidden, Scene, dof_of, share_of_torque
from shared.sim.hidden.robot import Law, Moment, Robot


def _places(scene: Scene) -> tuple[str, ...]:
    """Return the joints of an arm whose model has none; elsewhere it is no surprise."""
    return scene.joints if scene.arm.name == "torque2" else ()


def _enter(robot: Robot, case: Case) -> None:
    robot.laws.append(lambda: _rub(robot, case))


def _rub(robot: Robot, case: Case) -> Law:
    bristles = Bristles()

    def act(moment: Moment) -> None:
        dof = dof_of(robot, moment.model, case.place)
        speed = float(moment.data.qvel[dof])
        moment.data.qfrc_applied[dof] += bristles.torque(case.size, speed, moment.timestep)

    return act


HIDDEN = Hidden(
    name="coulomb_friction",
    way="bristles, not a constraint",
    places=_places,
    sizes=share_of_torque(1e-3, 0.1),
    values=lambda case: {"level": (case.size, "N m")},
    enter=_enter,
)
