"""What can be hidden: each is a small module of ``effects/``, which has ``HIDDEN``."""

import importlib
import pkgutil
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Final

import mujoco
import numpy as np

from shared.sim.arm import Float64
from shared.sim.hidden import effects as _modules
from shared.sim.hidden.arms import HiddenArm
from shared.sim.hidden.robot import Robot

SHAPE: Final = 4
"""Numbers between 0 and 1 that say what the size does not: a direction, an instant."""
IN: Final = " in "
"""Between the joint and the recording in the name of a place."""


@dataclass(frozen=True)
class Scene:
    """What it is hidden in."""

    arm: HiddenArm
    trajectories: tuple[str, ...]
    """Names of the recordings, in the order they are made in."""
    train: tuple[str, ...]
    """Of those that may be fitted to."""
    duration: float
    """Of each recording (s)."""

    @property
    def joints(self) -> tuple[str, ...]:
        """Return the logged joints."""
        return self.arm.joints

    def torque(self, joint: str) -> float:
        """Return a joint's largest torque (N m)."""
        return float(self.arm.torque[self.joints.index(joint)])

    def speed(self, joint: str) -> float:
        """Return how fast a joint is told to go (rad/s)."""
        return float(self.arm.speed[self.joints.index(joint)])

    def middle(self, joint: str) -> float:
        """Return the middle of where a joint goes (rad)."""
        return float(self.arm.rest[self.joints.index(joint)])

    def reach(self, joint: str) -> float:
        """Return how far it goes from there (rad)."""
        return float(self.arm.reach[self.joints.index(joint)])


@dataclass(frozen=True)
class Case:
    """An effect at a place, of a size."""

    name: str
    scene: Scene
    place: str
    size: float
    """How big it is, in the unit of the first of its numbers."""
    shape: Float64
    """float64[SHAPE] between 0 and 1."""


Values = dict[str, tuple[float, str]]
"""Numbers by the names that the catalogue of identification has for them, each with its unit."""


@dataclass(frozen=True)
class Hidden:
    """One thing that may be wrong with a robot."""

    name: str
    """As the catalogue calls it."""
    way: str
    """How it enters, where identification may do otherwise; in a few words."""
    places: Callable[[Scene], tuple[str, ...]]
    """Returns where it may sit, as the catalogue calls that; nothing where it cannot be."""
    sizes: Callable[[Scene, str], tuple[float, float]]
    """Returns the smallest and the largest size at a place that make sense."""
    values: Callable[[Case], Values]
    """Returns what it is in the catalogue's numbers."""
    enter: Callable[[Robot, Case], None]
    """Puts it into a robot that is not yet compiled."""


@cache
def hidden_effects() -> dict[str, Hidden]:
    """Return all of them by name."""
    found: list[Hidden] = [
        importlib.import_module(f"{_modules.__name__}.{module.name}").HIDDEN
        for module in pkgutil.iter_modules(_modules.__path__)
    ]
    return {each.name: each for each in sorted(found, key=lambda each: each.name)}


def whole_arm(scene: Scene) -> tuple[str, ...]:
    """Return the place of what is not at one joint."""
    return ("",)


def servos_alike(scene: Scene) -> tuple[str, ...]:
    """Return the place of what all servos have alike; none where there are no servos."""
    return whole_arm(scene) if scene.arm.control == "position" else ()


def servos(scene: Scene) -> tuple[str, ...]:
    """Return the places of what all servos have alike, or one of them."""
    alike = servos_alike(scene)
    return (*alike, *scene.joints) if alike else ()


def every_joint(scene: Scene) -> tuple[str, ...]:
    """Return the logged joints."""
    return scene.joints


def share_of_torque(low: float, high: float) -> Callable[[Scene, str], tuple[float, float]]:
    """Return sizes between two shares of a joint's largest torque."""
    return lambda scene, place: (low * scene.torque(place), high * scene.torque(place))


def dof_of(robot: Robot, model: mujoco.MjModel, label: str) -> int:
    """Return the index of a logged joint's velocity."""
    return int(model.joint(robot.plant.mj_joint(label)).dofadr[0])


def sign(number: float) -> float:
    """Return -1 or 1 for a number between 0 and 1."""
    return 1.0 if number >= 0.5 else -1.0


def direction(shape: Float64) -> Float64:
    """Return a unit vector, evenly distributed as the first two numbers are."""
    height, turn = 2.0 * shape[0] - 1.0, 2.0 * np.pi * shape[1]
    across = np.sqrt(1.0 - height**2)
    return np.array([across * np.cos(turn), across * np.sin(turn), height])
