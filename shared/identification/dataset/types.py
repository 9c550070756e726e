"""A data set in memory: what was commanded, what the joints did, what a tracker saw.

Times are seconds since the start of their trajectory on the recorder's clock; a tracker's are on
its own clock, from the same instant as well as anybody knows.
"""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Float64 = NDArray[np.float64]
Control = Literal["pose", "position", "torque"]
"""What a command is: a pose of the tool, a position per joint, or a torque per joint."""
Split = Literal["train", "test"]
Kind = Literal["pr2", "mjcf"]
EncoderSide = Literal["motor", "link"]
"""Which side of a joint's gear its readings are of."""

POSE = ("x", "y", "z", "qw", "qx", "qy", "qz")
"""Columns of a pose: position (m) and unit quaternion, in the robot's base frame."""


@dataclass(frozen=True)
class ModelSource:
    """Which simulation the data are compared with."""

    kind: Kind
    path: Path | None = None
    """The MJCF file of ``kind = "mjcf"``."""
    arm: Literal["right", "left"] = "right"
    """Which of a PR2's arms."""
    parameters: Path | None = None
    """A ``model.toml`` of a PR2; None is the nominal model."""
    tracked: str = ""
    """Site or body of an MJCF that the tracker is fixed to."""
    encoders: EncoderSide | None = None
    unlimited: tuple[str, ...] = ()
    """Joints whose drives give far more than the model file says."""
    """Of an MJCF's joints; None where nobody said. A servo goes by the motor's side anyway."""
    timestep: float | None = None
    """Of the physics of an MJCF (s), if it is not to be the file's."""


@dataclass(frozen=True)
class Trajectory:
    """One recording, from rest or from a given state."""

    name: str
    split: Split
    repeats: str
    """Name of the trajectory whose commands this one repeats; empty if none."""
    initial_q: Float64
    """float64[J], joint positions at time 0 (rad, m)."""
    initial_qd: Float64
    """float64[J], joint velocities at time 0 (rad/s, m/s)."""
    command_at: Float64
    """float64[C], when each command was given (s), rising."""
    command: Float64
    """float64[C, U]: poses, positions (rad, m) or torques (N m, N); each holds until the next."""
    joints_at: Float64
    """float64[T] (s), rising."""
    q: Float64
    """float64[T, J] (rad, m)."""
    qd: Float64 | None = None
    """float64[T, J] (rad/s, m/s), as logged."""
    effort: Float64 | None = None
    """float64[T, J] (N m, N), as logged: what the controller asked of each joint."""
    tracker_at: Float64 | None = None
    """float64[K] on the tracker's clock (s), rising."""
    tracker: Float64 | None = None
    """float64[K, 7], poses in the robot's base frame."""

    @property
    def duration(self) -> float:
        """Return the time of the last joint reading (s)."""
        return float(self.joints_at[-1])


@dataclass(frozen=True)
class Caveat:
    """Something about the data that limits what can be found."""

    name: str
    """Fixed, for programs: ``no_repeat``, ``gap``, ``little_excitation``, ..."""
    trajectory: str
    """Empty: the whole set."""
    text: str
    """What, which value, what to do."""


@dataclass(frozen=True)
class Dataset:
    """Recordings of one robot under one controller."""

    folder: Path
    source: ModelSource
    control: Control
    joints: tuple[str, ...]
    """Names of the logged joints, in the order of every array."""
    actuators: tuple[str, ...]
    """Names of the command's columns: those of ``POSE``, or the actuators."""
    trajectories: tuple[Trajectory, ...]
    caveats: tuple[Caveat, ...]
    hash: str
    """SHA-256 of the files."""

    @property
    def train(self) -> tuple[Trajectory, ...]:
        """Return what is fitted to; repeats only say what noise is."""
        return self._of("train")

    @property
    def test(self) -> tuple[Trajectory, ...]:
        """Return what is held out."""
        return self._of("test")

    def _of(self, split: Split) -> tuple[Trajectory, ...]:
        return tuple(each for each in self.trajectories if each.split == split and not each.repeats)

    @property
    def has_tracker(self) -> bool:
        """Whether every trajectory was tracked."""
        return all(each.tracker is not None for each in self.trajectories)


def with_encoders(dataset: Dataset, encoders: EncoderSide) -> Dataset:
    """Return the recordings as of encoders on one side of the joints' gears."""
    return replace(dataset, source=replace(dataset.source, encoders=encoders))


def with_timestep(dataset: Dataset, timestep: float) -> Dataset:
    """Return the recordings with another time step of the model's physics (s)."""
    return replace(dataset, source=replace(dataset.source, timestep=timestep))


def without_limits(dataset: Dataset, joints: tuple[str, ...]) -> Dataset:
    """Return the recordings with drives of some joints that give far more than the file says."""
    return replace(dataset, source=replace(dataset.source, unlimited=joints))
