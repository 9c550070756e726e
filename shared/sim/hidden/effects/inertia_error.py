"""A link is heavier than the model says: a body of its own is welded to it."""

import numpy as np

from shared.sim.hidden.effect import Case, Hidden, Scene
from shared.sim.hidden.robot import Robot


def _places(scene: Scene) -> tuple[str, ...]:
    """Return the last links but the tool's: what those before carry is like armature."""
    return {
        "pr2": ("forearm_roll", "wrist_flex"),
        "arm3": ("yaw", "shoulder"),
        "torque2": ("shoulder",),
    }[scene.arm.name]


def _enter(robot: Robot, case: Case) -> None:
    link = robot.joint(case.place).parent
    made = link.add_body(name="ballast", pos=np.array(link.ipos, np.float64))
    made.explicitinertial = True
    made.mass = case.size * float(link.mass)
    made.ipos = [0.0, 0.0, 0.0]
    full = np.asarray(link.fullinertia, np.float64)
    if np.isfinite(full[0]):
        made.fullinertia = case.size * full
    else:
        made.inertia, made.iquat = case.size * np.asarray(link.inertia), link.iquat


HIDDEN = Hidden(
    name="inertia_error",
    way="an added body",
    places=_places,
    sizes=lambda scene, place: (0.25, 1.8),
    values=lambda case: {"share": (case.size, "1")},
    enter=_enter,
)
