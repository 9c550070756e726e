"""The base stands at a tilt: each body is pulled aside, gravity itself stays."""

import numpy as np

from shared.sim.arm import Float64
from shared.sim.hidden.effect import Case, Hidden, Scene
from shared.sim.hidden.robot import Law, Moment, Robot


def _places(scene: Scene) -> tuple[str, ...]:
    """Return the whole arm, if it has weight."""
    return () if scene.arm.control == "pose" else ("",)


def _turn(case: Case) -> Float64:
    heading = 2.0 * np.pi * float(case.shape[0])
    return case.size * np.array([np.cos(heading), np.sin(heading), 0.0])


def _enter(robot: Robot, case: Case) -> None:
    robot.laws.append(lambda: _pull(_turn(case)))


def _pull(turn: Float64) -> Law:
    angle = float(np.linalg.norm(turn))
    axis = turn / angle

    def pull(moment: Moment) -> None:
        model = moment.model
        gravity = np.array(model.opt.gravity)  # at a right angle to the axis
        aside = (np.cos(angle) - 1.0) * gravity + np.sin(angle) * np.cross(axis, gravity)
        moment.data.xfrc_applied[:, :3] += model.body_mass[:, None] * aside

    return pull


HIDDEN = Hidden(
    name="gravity_tilt",
    way="a force on each body",
    places=_places,
    sizes=lambda scene, place: (1e-3, 0.15),
    values=lambda case: {
        "about_x": (float(_turn(case)[0]), "rad"),
        "about_y": (float(_turn(case)[1]), "rad"),
    },
    enter=_enter,
)
