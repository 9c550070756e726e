"""What is being identified: one arm, how it is driven, and what its recordings reach."""

import functools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from shared.errors import IdentificationError
from shared.identification.arm.known_efforts import known_effort_of
from shared.identification.arm.motion import motion_of
from shared.identification.arm.parts import CUTS, tracker_of
from shared.identification.arm.ripples import ripples_of
from shared.identification.arm.slips import slips_of
from shared.identification.arm.starts import Starts, starts_apart
from shared.identification.dataset.types import POSE, Dataset, Float64, ModelSource, Trajectory
from shared.sim.plant.inverse import inverse_dynamics
from shared.sim.plant.plant import Control, Plant, is_weightless, mjcf, pr2, stepped, unlimited
from shared.sim.plant.replay import Recorded
from shared.sim.plant.rollouts import Rollouts
from shared.sim.plant.signals import Signal

_SPARSE = 5
"""Of the instants of a motion, every so many say what torque it takes."""


@dataclass(frozen=True)
class Subject:
    """What effects and base parameters may ask about the arm before anything is simulated."""

    plant: Plant
    nominal: Rollouts
    """The arm as the model file has it; its ``model`` has the nominal numbers."""
    has_tracker: bool
    has_gravity: bool
    trajectories: tuple[str, ...]
    """Names."""
    duration: float
    """Of the longest trajectory (s)."""
    travel: Float64
    """float64[J], range of each joint over all trajectories (rad, m)."""
    lowest: Float64
    """float64[J], smallest position of each joint (rad, m)."""
    speed: Float64
    """float64[J], speed that each joint exceeds 2 % of the time (rad/s, m/s)."""
    acceleration: Float64
    """float64[J], the same of its acceleration (rad/s^2, m/s^2)."""
    drive: Float64
    """float64[J], torque that the recorded motion takes of each joint of the nominal arm, exceeded
    2 % of the time (N m, N)."""
    recordings: tuple[Trajectory, ...] = ()
    """What was recorded, in the order of recording."""

    @functools.cached_property
    def ripples(self) -> tuple[tuple[float, ...], ...]:
        """Return where each joint's torque may ripple: the strongest few cycles per rad (m)."""
        return ripples_of(self.nominal, self.recordings)

    @functools.cached_property
    def slips(self) -> dict[str, tuple[float, ...]]:
        """Return when the tracker may have slipped, by recording to fit to (s, its own clock)."""
        return slips_of(self.nominal, self.recordings)

    @functools.cached_property
    def starts(self) -> Starts:
        """Return what repeats differ by for starting elsewhere than what they repeat."""
        replayed = _replayed(self.recordings)
        recorded = list(zip(self.recordings, replayed, strict=True))
        return starts_apart(self.nominal, recorded, CUTS.get(self.control))

    @property
    def control(self) -> Control:
        """Return what a command is."""
        return self.plant.control

    @property
    def joints(self) -> tuple[str, ...]:
        """Return the logged joints."""
        return self.plant.labels


def plant_of(dataset: Dataset, source: ModelSource | None = None) -> Plant:
    """Return the arm that a data set is of.

    Raises:
        IdentificationError: the model does not fit the recordings.
    """
    source = source or dataset.source
    if source.kind == "pr2":
        plant = pr2(source.arm, source.parameters)
        if dataset.control != "pose" or dataset.actuators != POSE:
            raise IdentificationError('kind = "pr2" needs control = "pose": its controller is one')
        if sorted(plant.labels) != sorted(dataset.joints):
            raise IdentificationError(
                f"a PR2's arm has the joints {', '.join(plant.labels)}; "
                f"joints.parquet has {', '.join(dataset.joints)}"
            )
        return plant
    if source.path is None:
        raise IdentificationError('[model] kind = "mjcf" needs path, the MJCF file')
    plant = mjcf(
        source.path,
        dataset.control,
        dataset.joints,
        dataset.actuators,
        source.tracked,
        encoders=source.encoders or "motor",
    )
    if source.unlimited:
        plant = unlimited(plant, source.unlimited)
    return plant if source.timestep is None else stepped(plant, source.timestep)


def subject_of(dataset: Dataset, capacity: int = 128, threads: int = 1) -> Subject:
    """Return the arm of a data set and what its recordings reach.

    Args:
        dataset: the recordings.
        capacity: the most arms that are simulated at once.
        threads: of their physics.
    """
    plant = plant_of(dataset)
    nominal = Rollouts(plant, (), capacity, threads)
    q = np.concatenate([each.q for each in dataset.trajectories])
    motions = [motion_of(each) for each in dataset.trajectories]
    speeds, accelerations = (
        np.concatenate([getattr(each, name) for each in motions]) for name in ("qd", "qdd")
    )
    drives = [
        np.concatenate(
            [
                inverse_dynamics(plant, nominal.model, each.q, each.qd, each.qdd)
                for each in (motion.sparse(_SPARSE) for motion in motions)
            ]
        )
    ]
    known = [known_effort_of(nominal, each, each.joints_at) for each in dataset.trajectories]
    if all(each is not None for each in known):  # friction that the model lacks is in them
        drives.append(np.concatenate([each for each in known if each is not None]))
    return Subject(
        plant=plant,
        nominal=nominal,
        has_tracker=dataset.has_tracker,
        has_gravity=not is_weightless(nominal.model),
        trajectories=tuple(each.name for each in dataset.trajectories),
        duration=max(each.duration for each in dataset.trajectories),
        travel=np.ptp(q, axis=0),
        lowest=q.min(axis=0),
        speed=np.quantile(np.abs(speeds), 0.98, axis=0),
        acceleration=np.quantile(np.abs(accelerations), 0.98, axis=0),
        drive=np.max([np.quantile(np.abs(each), 0.98, axis=0) for each in drives], axis=0),
        recordings=dataset.trajectories,
    )


def recorded_of(dataset: Dataset) -> tuple[Recorded, ...]:
    """Return what each trajectory is replayed from."""
    return _replayed(dataset.trajectories)


def _replayed(recordings: Sequence[Trajectory]) -> tuple[Recorded, ...]:
    return tuple(
        Recorded(
            initial_q=each.initial_q,
            initial_qd=each.initial_qd,
            command=Signal(each.command_at, each.command),
            logged_q=Signal(each.joints_at, each.q),
            joints_at=each.joints_at,
            tracker_at=each.tracker_at,
            trajectory=each.name,
            earlier=tuple(other.name for other in recordings[:index]),
            logged_tracker=tracker_of(each),
        )
        for index, each in enumerate(recordings)
    )
