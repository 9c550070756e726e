"""Data sets of recordings made elsewhere: what their converters share."""

import hashlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from shared.errors import IdentificationError
from shared.identification.dataset.types import Dataset, Float64, ModelSource, Split, Trajectory
from shared.identification.dataset.writing import write_dataset


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


def write(
    folder: Path, model: str, joints: tuple[str, ...], trajectories: tuple[Trajectory, ...],
    raw: Mapping[str, Path], notes: Mapping[str, Any],
) -> None:  # fmt: skip
    """Write recordings under torque control beside the MJCF they are compared with.

    Args:
        folder: the new data set.
        model: the MJCF's text; it becomes ``model.xml``.
        joints: names, of actuators too.
        trajectories: the recordings.
        raw: the files they were taken from, for the record.
        notes: source and licence, for people.
    """
    dataset = Dataset(
        folder=folder, source=ModelSource("mjcf", folder / "model.xml"), control="torque",
        joints=joints, actuators=joints, trajectories=trajectories, caveats=(), hash="",
    )  # fmt: skip
    hashes = {name: hashlib.sha256(path.read_bytes()).hexdigest() for name, path in raw.items()}
    write_dataset(dataset, folder, {**notes, "sha256": hashes}, {"model.xml": model.encode()})


def there(folder: Path, name: str) -> Path:
    """Return the path of a raw recording.

    Raises:
        IdentificationError: it is not there.
    """
    if not (path := folder / name).is_file():
        raise IdentificationError(f"{folder} has no {name}: give the folder of the raw recordings")
    return path
