"""Something pushed the arm once."""

import numpy as np

from shared.identification.arm.places import place_of
from shared.identification.arm.subject import Subject
from shared.identification.dataset.types import Float64
from shared.identification.effect import IN_RECORDING, Quantity, Side
from shared.sim.plant.row import Row
from shared.sim.plant.step import Step
from shared.sim.plant.structure import Structure

_WINDOW = 0.5
"""Of the windows in which it is first looked for (s): much longer than a push, one hides it."""
_MOST_WINDOWS = 40
"""Of one recording."""


class _Push:
    """A constant torque within a window of time, of one joint; values: begin, end, torques."""

    memory = 0

    def __call__(self, step: Step, values: Float64, memory: Float64) -> Float64:
        begin, end = values[:, 0], values[:, 1]
        # The part of the step that is in the window: so that its ends need not be on the grid.
        inside = np.minimum(end, step.time + step.timestep) - np.maximum(begin, step.time)
        share = np.clip(inside / step.timestep, 0.0, 1.0)
        return share[:, None] * values[:, 2:]


_PUSH = _Push()


class ExternalContact:
    """One push: a torque at one joint, during one window of one recording."""

    name = "external_contact"
    title = "something pushed the arm"
    signature = "One event in one recording, as if a torque acted from one instant to another."
    side: Side = "plant"

    def places(self, subject: Subject) -> tuple[str, ...]:
        """Return every joint in every recording: ``elbow in swings``."""
        return tuple(
            f"{joint}{IN_RECORDING}{trajectory}"
            for trajectory in subject.trajectories
            for joint in subject.joints
        )

    def quantities(self, subject: Subject, place: str) -> tuple[Quantity, ...]:
        """Return the torque and its window, looked for in windows that cover the recording."""
        name, trajectory = place.split(IN_RECORDING, 1)
        joint = place_of(subject, name)
        most = 20.0 * joint.drive
        until = _duration(subject, trajectory)
        count = int(np.clip(round(until / _WINDOW), 2, _MOST_WINDOWS))
        length = until / count
        begins = tuple(float(begin) for begin in length * np.arange(count))
        return (
            Quantity("torque", joint.torque, -most, most, probe=0.5 * joint.drive),
            Quantity("begin", "s", 0.0, until, probe=length, grid=begins),
            Quantity("length", "s", 0.0, until, probe=length, grid=(length,)),
        )

    def structure(self, subject: Subject, place: str) -> Structure:
        """Return nothing: it is a torque."""
        return ()

    def enter(self, row: Row, place: str, values: Float64) -> None:
        """Push the joint, if this is the recording; instants are the recording's."""
        joint, trajectory = place.split(IN_RECORDING, 1)
        torque, begin, length = (float(value) for value in values)
        if trajectory != row.trajectory or torque == 0.0 or length <= 0.0:
            return
        begin -= row.begin
        if begin >= row.duration or begin + length <= 0.0:  # of a part of the recording
            return
        torques = np.zeros(len(row.plant.labels))
        torques[row.plant.labels.index(joint)] = torque
        row.torque(_PUSH, np.concatenate([[begin, begin + length], torques]))


def _duration(subject: Subject, trajectory: str) -> float:
    """Return how long a recording is; the longest if there is none of the name (s)."""
    found = [each.duration for each in subject.recordings if each.name == trajectory]
    return found[0] if found else subject.duration


EFFECT = ExternalContact()
