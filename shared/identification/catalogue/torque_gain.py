"""A joint's drive gives more or less torque than it is asked for."""

import numpy as np

from shared.identification.arm.places import moving
from shared.identification.arm.subject import Subject
from shared.identification.dataset.types import Float64
from shared.identification.effect import Quantity, Side
from shared.sim.plant.row import Row, drives_of
from shared.sim.plant.step import Step
from shared.sim.plant.structure import Structure


class _Law:
    """More of what the drive gives, at each joint; for a servo that pulls at the tool.

    What the drive gives now is taken to rise as it did in the last step.
    """

    memory = 0

    def __call__(self, step: Step, values: Float64, memory: Float64) -> Float64:
        return values * (step.drive + step.drive_change)


_LAW = _Law()


class TorqueGain:
    """A wrong torque constant, or current sensor: (1 + g) of the torque, its limit included."""

    name = "torque_gain"
    title = "the joint's drive gives another torque than it is asked for"
    signature = "A torque in proportion to what the controller asks of the joint."
    side: Side = "plant"

    def places(self, subject: Subject) -> tuple[str, ...]:
        """Return the joints that move and have a drive."""
        labels = tuple(place.label for place in moving(subject))
        if subject.control == "pose":
            return labels
        model = subject.nominal.model
        return tuple(label for label in labels if drives_of(subject.plant, model, label))

    def quantities(self, subject: Subject, place: str) -> tuple[Quantity, ...]:
        """Return the share that there is too much."""
        return (Quantity("share", "1", -0.6, 1.0, probe=0.1),)

    def structure(self, subject: Subject, place: str) -> Structure:
        """Return nothing: the drives are there."""
        return ()

    def enter(self, row: Row, place: str, values: Float64) -> None:
        """Scale the joint's own drives, or what the pose servo puts on the joint."""
        share = float(values[0])
        joint = row.plant.labels.index(place)
        if not (drives := row.drives_of(place)):
            row.torque(_LAW, np.where(np.arange(len(row.plant.labels)) == joint, share, 0.0))
            return
        for drive in drives:
            for field in ("actuator_gainprm", "actuator_biasprm", "actuator_forcerange"):
                row.field(field)[drive] *= 1.0 + share
        limit = row.mj_joint(row.plant.mj_joint(place))
        row.field("jnt_actfrcrange")[limit] *= 1.0 + share


EFFECT = TorqueGain()
