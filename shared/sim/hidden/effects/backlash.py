"""A joint's gear has play: between its flanks the link is free."""

import numpy as np

from shared.sim.hidden.effect import Case, Hidden, every_joint
from shared.sim.hidden.robot import Law, Moment, Robot
from shared.sim.hidden.series import add_series, series_dof, series_qpos

_FLANK = 1.5e-3
"""How far flanks give under the largest torque (rad)."""
_LOSS = 1e-3
"""Damping per stiffness while they touch (s)."""


def _enter(robot: Robot, case: Case) -> None:
    add_series(robot, case.place)
    stiffness = case.scene.torque(case.place) / _FLANK
    robot.laws.append(lambda: _flanks(case.place, 0.5 * case.size, stiffness))
    robot.trust_encoders()


def _flanks(place: str, half: float, stiffness: float) -> Law:
    def act(moment: Moment) -> None:
        model, data = moment.model, moment.data
        dof, qpos = series_dof(model, place), series_qpos(model, place)
        angle = float(data.qpos[qpos])
        pressed = angle - float(np.clip(angle, -half, half))
        model.dof_damping[dof] = _LOSS * stiffness if pressed else 0.01
        data.qfrc_applied[dof] -= stiffness * pressed

    return act


HIDDEN = Hidden(
    name="backlash",
    way="flanks as stiff springs; a pose controller that knows encoders only",
    places=every_joint,
    sizes=lambda scene, place: (5e-4, 0.08),
    values=lambda case: {"gap": (case.size, "rad")},
    enter=_enter,
)
