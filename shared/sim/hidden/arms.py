"""The arms that data sets are made of: what they are, where they rest and how far they may go."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Literal, get_args

import numpy as np

from shared.sim.arm import Float64
from shared.sim.config import JointName
from shared.sim.plant.plant import Control, Plant, mjcf, pr2

ArmName = Literal["pr2", "arm3", "torque2"]
_DATA: Final = Path(__file__).parent / "data"


@dataclass(frozen=True)
class HiddenArm:
    """An arm to make data of."""

    name: ArmName
    make: Callable[[], Plant]
    """Returns it as the model file has it."""
    control: Control
    joints: tuple[str, ...]
    """As the log calls them."""
    rest: Float64
    """float64[J], posture that motion begins in (rad)."""
    reach: Float64
    """float64[J], how far from there it may go (rad)."""
    speed: Float64
    """float64[J], how fast it may be told to go (rad/s)."""
    torque: Float64
    """float64[J], largest torque of each joint: the scale of disturbances (N m)."""
    file: Path | None = None
    """Its MJCF; None is the built-in PR2."""
    tracked: str = ""


_PR2: Final[tuple[str, ...]] = get_args(JointName)
_ARM3: Final = ("yaw", "shoulder", "elbow")
_TORQUE2: Final = ("shoulder", "elbow")


def _of_file(name: str, control: Control, joints: tuple[str, ...]) -> Callable[[], Plant]:
    return lambda: mjcf(_DATA / f"{name}.xml", control, joints, joints, "tool")


ARMS: Final[dict[ArmName, HiddenArm]] = {
    "pr2": HiddenArm(
        name="pr2",
        make=lambda: pr2("right", None),
        control="pose",
        joints=_PR2,
        rest=np.array([-0.85, 0.30, -1.50, -1.45, 0.50, -1.00, 1.46]),
        reach=np.array([0.45, 0.40, 0.50, 0.45, 0.60, 0.50, 0.70]),
        speed=np.array([0.8, 0.8, 1.6, 1.6, 2.0, 1.8, 2.2]),
        torque=np.array([11.88, 11.64, 6.143, 6.804, 3.6, 5.568, 5.568]),
    ),
    "arm3": HiddenArm(
        name="arm3",
        make=_of_file("arm3", "position", _ARM3),
        control="position",
        joints=_ARM3,
        rest=np.array([0.0, -0.4, 1.1]),
        reach=np.array([1.0, 0.6, 0.8]),
        speed=np.array([3.0, 2.5, 3.5]),
        torque=np.array([18.0, 30.0, 14.0]),
        file=_DATA / "arm3.xml",
        tracked="tool",
    ),
    "torque2": HiddenArm(
        name="torque2",
        make=_of_file("torque2", "torque", _TORQUE2),
        control="torque",
        joints=_TORQUE2,
        rest=np.zeros(2),
        reach=np.array([0.8, 0.9]),
        speed=np.array([4.0, 5.0]),
        torque=np.array([8.0, 4.0]),
        file=_DATA / "torque2.xml",
        tracked="tool",
    ),
}  # fmt: skip
