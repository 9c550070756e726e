"""What the arm stands on gives about a horizontal axis, and the arm does not know."""

import mujoco
import numpy as np

from shared.sim.arm import Float64
from shared.sim.hidden.effect import Case, Hidden, Scene, whole_arm
from shared.sim.hidden.robot import Law, Moment, Robot

_LOSS = 4e-3
"""Damping per stiffness (s)."""
_FOOT = "foot"


def _parts(case: Case) -> Float64:
    """Return float64[2], compliance about x and y (rad/(N m))."""
    share = 0.15 + 0.7 * float(case.shape[0])
    return case.size * np.array([share, 1.0 - share]) / max(share, 1.0 - share)


def _sizes(scene: Scene, place: str) -> tuple[float, float]:
    """Return what turns by 0.2 mrad to 30 mrad under the largest torque of the arm."""
    return 2e-4 / float(scene.arm.torque.max()), 0.03 / float(scene.arm.torque.max())


def _enter(robot: Robot, case: Case) -> None:
    base = robot.spec.body(robot.plant.base_body)
    heading = np.array(base.quat, np.float64)
    inverse = np.empty(4)
    mujoco.mju_negQuat(inverse, heading)
    for index, name in enumerate((f"{_FOOT} x", f"{_FOOT} y")):
        axis = np.empty(3)
        mujoco.mju_rotVecQuat(axis, np.eye(3)[index], inverse)
        made = base.add_joint(name=name, type=mujoco.mjtJoint.mjJNT_HINGE, axis=axis)
        made.armature = 0.05
    # What stands still may have no mass, what moves must.
    robot.spec.compiler.boundmass = max(float(robot.spec.compiler.boundmass), 1e-6)
    robot.spec.compiler.boundinertia = max(float(robot.spec.compiler.boundinertia), 1e-9)
    _stand_still(robot)
    robot.laws.append(lambda: _spring(1.0 / _parts(case)))
    robot.trust_encoders()


def _stand_still(robot: Robot) -> None:
    """Let the tracker measure from where the base was, not from where it sways to."""
    for sensor in robot.spec.sensors:
        if not sensor.refname:
            continue
        site = robot.spec.site(sensor.refname)
        body = site.parent
        still = f"{sensor.refname} at rest"
        if robot.spec.site(still) is None:
            place, heading = np.empty(3), np.empty(4)
            mujoco.mju_rotVecQuat(place, site.pos, body.quat)
            mujoco.mju_mulQuat(heading, body.quat, site.quat)
            robot.spec.worldbody.add_site(name=still, pos=body.pos + place, quat=heading)
        sensor.refname = still


def _spring(stiffness: Float64) -> Law:
    def act(moment: Moment) -> None:
        model, data = moment.model, moment.data
        for name, value in zip((f"{_FOOT} x", f"{_FOOT} y"), stiffness.tolist(), strict=True):
            joint = model.joint(name)
            dof, qpos = int(joint.dofadr[0]), int(joint.qposadr[0])
            model.dof_damping[dof] = _LOSS * value
            data.qfrc_applied[dof] -= value * float(data.qpos[qpos])

    return act


HIDDEN = Hidden(
    name="base_compliance",
    way="springs as torques, with another damping; a pose controller that knows encoders only",
    places=whole_arm,
    sizes=_sizes,
    values=lambda case: {
        "about_x": (float(_parts(case)[0]), "rad/(N m)"),
        "about_y": (float(_parts(case)[1]), "rad/(N m)"),
    },
    enter=_enter,
)
