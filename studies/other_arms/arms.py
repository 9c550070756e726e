"""Three arms: six joints whose weight is carried, a scara with weak servos, three under torques."""

from dataclasses import dataclass
from typing import Final

import numpy as np

from shared.identification.dataset.types import Float64
from shared.sim.plant.plant import Control


@dataclass(frozen=True)
class Link:
    """What one joint moves."""

    joint: str
    axis: str
    place: str
    """In the link before (m)."""
    end: str
    """Of the rod that it is, from the joint (m)."""
    mass: float
    """(kg)."""
    kind: str = "hinge"


@dataclass(frozen=True)
class Numbers:
    """What a model file says of each joint, and the arm otherwise; float64[J] each."""

    armature: Float64
    """(kg m^2, kg)."""
    damping: Float64
    """(N m s/rad, N s/m)."""
    friction: Float64
    """(N m, N)."""
    kp: Float64
    """Of the controller, in the file or outside of it (N m/rad, N/m)."""
    kv: Float64
    """(N m s/rad, N s/m)."""

    def spread(self, by: float, rng: np.random.Generator) -> "Numbers":
        """Return other numbers, each times a random factor of that logarithmic spread."""
        own = (self.armature, self.damping, self.friction, self.kp, self.kv)
        return Numbers(*(each * np.exp(rng.normal(0.0, by, len(each))) for each in own))


@dataclass(frozen=True)
class Arm:
    """One of the arms, as its file has it."""

    links: tuple[Link, ...]
    control: Control
    numbers: Numbers
    limit: Float64
    """Largest torques, about twice what the motions take (N m, N)."""
    home: Float64
    swing: Float64
    """How far joints go from home (rad, m)."""
    period: float
    """Of the log and, under torques, of the controller (s)."""
    noise: float
    """Of readings (rad, m)."""
    push: float
    """Of the random torque that comes every 0.5 ms, as a share of the largest."""
    gravcomp: int = 0

    @property
    def joints(self) -> tuple[str, ...]:
        """Return their names."""
        return tuple(link.joint for link in self.links)

    def mjcf(self, numbers: Numbers, timestep: float) -> str:
        """Return the arm's MJCF with such numbers; servos are in it unless torques are logged."""
        bodies = ""
        for index, link in enumerate(self.links):
            bodies += (
                f'<body name="{link.joint}_link" pos="{link.place}" gravcomp="{self.gravcomp}">'
                f'<joint name="{link.joint}" type="{link.kind}" axis="{link.axis}" '
                f'armature="{numbers.armature[index]}" damping="{numbers.damping[index]}" '
                f'frictionloss="{numbers.friction[index]}"/>'
                f'<geom type="capsule" fromto="0 0 0 {link.end}" size="0.04" mass="{link.mass}"/>'
            )
        drives = ""
        for index, joint in enumerate(self.joints):
            most = self.limit[index]
            drives += (
                f'<motor name="{joint}" joint="{joint}" ctrlrange="-{most} {most}"/>'
                if self.control == "torque"
                else f'<position name="{joint}" joint="{joint}" kp="{numbers.kp[index]}" '
                f'kv="{numbers.kv[index]}" forcerange="-{most} {most}"/>'
            )
        return f"""<mujoco model="arm"><compiler angle="radian" autolimits="true"/>
  <option timestep="{timestep}" integrator="implicitfast"><flag contact="disable"/></option>
  <worldbody>{bodies}<site name="tool" pos="{self.links[-1].end}"/>{"</body>" * len(self.links)}
  </worldbody><actuator>{drives}</actuator></mujoco>"""


def _numbers(armature: str, damping: str, friction: str, kp: str, kv: str) -> Numbers:
    texts = (armature, damping, friction, kp, kv)
    return Numbers(*(np.array([float(word) for word in text.split()]) for text in texts))


ARMS: Final = {
    "six": Arm(
        links=(
            Link("base", "0 0 1", "0 0 0.1", "0 0.1 0", 3.7),
            Link("shoulder", "0 1 0", "0 0.13 0", "0 0 0.425", 8.4),
            Link("elbow", "0 1 0", "0 -0.12 0.425", "0 0 0.392", 2.3),
            Link("wrist_1", "0 1 0", "0 0 0.392", "0 0.09 0", 1.2),
            Link("wrist_2", "0 0 1", "0 0.093 0", "0 0 0.09", 1.2),
            Link("wrist_3", "0 1 0", "0 0 0.095", "0 0.08 0.02", 0.4),
        ),
        control="position",
        numbers=_numbers(
            "0.8 0.8 0.4 0.1 0.1 0.1", "4 4 3 1 1 0.6", "5 5 3 1 1 0.6",
            "3000 3000 2000 500 500 300", "150 150 90 20 20 10",
        ),
        limit=np.array([300.0, 300.0, 300.0, 56.0, 56.0, 56.0]),
        home=np.array([0.0, 0.6, 0.9, -0.5, 0.3, 0.0]),
        swing=np.array([0.9, 0.5, 0.7, 0.8, 0.9, 1.2]),
        period=0.008, noise=3e-5, push=7e-5, gravcomp=1,
    ),
    "scara": Arm(
        links=(
            Link("inner", "0 0 1", "0 0 0.3", "0.3 0 0", 2.5),
            Link("outer", "0 0 1", "0.3 0 0", "0.25 0 0", 1.4),
            Link("quill", "0 0 1", "0.25 0 0", "0 0 -0.15", 0.5, "slide"),
            Link("twist", "0 0 1", "0 0 -0.15", "0.04 0 -0.03", 0.3),
        ),
        control="position",
        numbers=_numbers("0.06 0.04 0.5 0.004", "1.2 0.7 12 0.05", "0.6 0.4 2.5 0.05",
                         "60 40 1500 4", "4 2.5 50 0.12"),
        limit=np.array([60.0, 40.0, 120.0, 6.0]),
        home=np.array([0.2, 0.6, 0.0, 0.0]),
        swing=np.array([0.9, 1.0, 0.06, 1.2]),
        period=0.01, noise=1e-4, push=1e-4,
    ),
    "three": Arm(
        links=(
            Link("pan", "0 0 1", "0 0 0.2", "0 0 0.1", 2.0),
            Link("lift", "0 1 0", "0 0 0.1", "0 0 0.3", 1.6),
            Link("elbow", "0 1 0", "0 0 0.3", "0.25 0 0", 0.9),
        ),
        control="torque",
        numbers=_numbers("0.05 0.05 0.03", "0.5 0.5 0.3", "0.4 0.4 0.2", "120 120 80", "8 8 4"),
        limit=np.array([60.0, 60.0, 30.0]),
        home=np.array([0.0, 0.3, 0.2]),
        swing=np.array([0.9, 0.6, 0.7]),
        period=0.004, noise=5e-5, push=5e-5,
    ),
}  # fmt: skip
