"""Controllers are told how fast to go: the slope from the command before to the one after."""

import numpy as np

from shared.sim.arm import Float64
from shared.sim.hidden.effect import Case, Hidden, servos
from shared.sim.hidden.robot import Hold, Robot
from shared.sim.plant.signals import Signal


def _enter(robot: Robot, case: Case) -> None:
    robot.leads.append(lambda: _lead(robot, case))


def _lead(robot: Robot, case: Case) -> Hold:
    """Return what a command's speed adds to it."""
    model, joints = robot.model, case.scene.joints
    own = np.array([case.place in ("", joint) for joint in joints])
    dofs = [int(model.joint(robot.plant.mj_joint(joint)).dofadr[0]) for joint in joints]
    servo = -model.actuator_biasprm[: len(joints)]
    worth = case.size * own * (servo[:, 2] + model.dof_damping[dofs]) / servo[:, 1]

    def lead(time: float, command: Signal) -> Float64:
        now = int(np.searchsorted(command.at, time + 0.5 * robot.timestep, side="right")) - 1
        if not 0 <= now < len(command.at) - 1:
            return np.zeros_like(worth)
        before = max(now - 1, 0)
        way = command.values[now + 1] - command.values[before]
        return worth * way / (command.at[now + 1] - command.at[before])

    return lead


HIDDEN = Hidden(
    name="velocity_feedforward",
    way="beside the command, from step to step",
    places=servos,
    sizes=lambda scene, place: (0.08, 1.2),
    values=lambda case: {"share": (case.size, "1")},
    enter=_enter,
)
