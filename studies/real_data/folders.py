"""Data sets of recordings made elsewhere: what their converters share."""

import argparse
import hashlib
from collections.abc import Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from shared.errors import IdentificationError
from shared.identification.dataset.types import Dataset, Float64, ModelSource, Split, Trajectory
from shared.identification.dataset.writing import write_dataset
from shared.sim.plant.plant import Control


def recording(
    name: str, split: Split, at: Float64, q: Float64, qd: Float64 | None, torque: Float64
) -> Trajectory:
    """Return a recording in which torques and joints were logged together.

    Args:
        name: of the recording.
        split: what it is for.
        at: float64[T] (s); it becomes 0 at the first reading.
        q: float64[T, J] (rad, m).
        qd: float64[T, J] (rad/s, m/s), as logged; None where it was not.
        torque: float64[T, J] (N m, N), what the drives gave.
    """
    at = at - at[0]
    start = np.zeros(q.shape[1]) if qd is None else qd[0]
    return Trajectory(name, split, "", q[0], start, at, torque, at, q, qd=qd)


def in_parts(
    at: Float64, q: Float64, torque: Float64, ends: tuple[float, float], parts: int, every: int = 1
) -> tuple[Trajectory, ...]:
    """Return a log of torques as recordings of one length, of which every third is held out.

    Args:
        at: float64[T] (s).
        q: float64[T, J] (rad, m).
        torque: float64[T, A] (N m, N).
        ends: what of it is taken (s).
        parts: recordings that it becomes.
        every: of so many readings one is taken.
    """
    cuts = pairwise(np.searchsorted(at, np.linspace(*ends, parts + 1)))
    found: list[Trajectory] = []
    for number, (first, last) in enumerate(cuts, 1):
        rows = slice(first, last, every)
        split: Split = "test" if number % 3 == 0 else "train"
        found.append(recording(f"part_{number}", split, at[rows], q[rows], None, torque[rows]))
    return tuple(found)


def write(
    folder: Path, model: str, control: Control, joints: tuple[str, ...],
    trajectories: tuple[Trajectory, ...], notes: Mapping[str, Any],
    driven: tuple[str, ...] = (),
) -> None:  # fmt: skip
    """Write recordings beside the MJCF they are compared with.

    Args:
        folder: the new data set.
        model: the MJCF's text; it becomes ``model.xml``.
        control: what the commands are.
        joints: names.
        trajectories: the recordings.
        notes: source and licence, for people.
        driven: joints with an actuator of their name; all if empty.
    """
    dataset = Dataset(
        folder=folder, source=ModelSource("mjcf", folder / "model.xml"), control=control,
        joints=joints, actuators=driven or joints, trajectories=trajectories, caveats=(), hash="",
    )  # fmt: skip
    write_dataset(dataset, folder, notes, {"model.xml": model.encode()})


def arm_of_motors(name: str, joints: Sequence[str], bodies: str, gravity: float = 9.81) -> str:
    """Return the MJCF of an arm with a motor, of its joint's name, at each joint.

    Args:
        name: of the model.
        joints: of the motors.
        bodies: MJCF; angles are in rad.
        gravity: downwards (m/s^2).
    """
    motors = "".join(f'\n    <motor name="{joint}" joint="{joint}"/>' for joint in joints)
    return f"""<mujoco model="{name}">
  <compiler angle="radian"/>
  <option timestep="0.002" gravity="0 0 {-gravity}"/>
  <worldbody>{bodies}
  </worldbody>
  <actuator>{motors}
  </actuator>
</mujoco>
"""


def hashes_of(raw: Mapping[str, Path]) -> dict[str, str]:
    """Return the SHA-256 of the files that recordings were taken from, for the record."""
    return {name: hashlib.sha256(path.read_bytes()).hexdigest() for name, path in raw.items()}


def parser_of(about: str | None, raw: Path | None = None) -> argparse.ArgumentParser:
    """Return what every converter is told: where to write, and where the recordings lie.

    Args:
        about: the converter's docstring.
        raw: where they lie unless it is said; None where it must be.
    """
    parser = argparse.ArgumentParser(description=about)
    parser.add_argument("out", type=Path, help="the new folder")
    parser.add_argument(
        "--raw", type=Path, default=raw, required=raw is None, help="where the recordings lie"
    )
    return parser


def there(folder: Path, name: str) -> Path:
    """Return the path of a raw recording.

    Raises:
        IdentificationError: it is not there.
    """
    if not (path := folder / name).is_file():
        raise IdentificationError(f"{folder} has no {name}: give the folder of the raw recordings")
    return path
