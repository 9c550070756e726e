"""The last two joints are driven through a differential, and its motors rub.

Each motor of a differential turns with the sum or the difference of both joints (a PR2's
WristTransmission), so its friction acts on both at once.
"""

from shared.identification.arm.places import moving, place_of
from shared.identification.arm.subject import Subject
from shared.identification.dataset.types import Float64
from shared.identification.effect import Quantity, Side
from shared.identification.laws.coupling import couple, coupling_names
from shared.sim.plant.row import Row
from shared.sim.plant.structure import Edit, Structure


class CoupledWrist:
    """Dry friction of the two motors behind the last two joints."""

    name = "coupled_wrist"
    title = "the motors of the wrist's differential have dry friction"
    signature = "The last joint's residual follows the motion of the one before, and the reverse."
    side: Side = "plant"

    def places(self, subject: Subject) -> tuple[str, ...]:
        """Return the last joint, if it and the one before are hinges that move."""
        last = subject.joints[-2:]
        able = {place.label for place in moving(subject) if not place.is_sliding}
        return (last[1],) if len(subject.joints) > 2 and able.issuperset(last) else ()

    def quantities(self, subject: Subject, place: str) -> tuple[Quantity, ...]:
        """Return the friction of the motor that turns with the sum, and of the other."""
        drive = min(place_of(subject, label).drive for label in subject.joints[-2:])
        return (
            Quantity("of_sum", "N m", 0.0, 2.0 * drive, probe=0.1 * drive),
            Quantity("of_difference", "N m", 0.0, 2.0 * drive, probe=0.1 * drive),
        )

    def structure(self, subject: Subject, place: str) -> Structure:
        """Return two tendons that are as long as sum and difference of the joints' angles."""
        before = subject.joints[subject.joints.index(place) - 1]
        return (Edit(f"differential {before} {place}", couple(before, place)),)

    def enter(self, row: Row, place: str, values: Float64) -> None:
        """Let the tendons rub."""
        friction = row.field("tendon_frictionloss")
        for name, value in zip(coupling_names(row.plant, place), values, strict=True):
            friction[row.model.tendon(name).id] += float(value)


EFFECT = CoupledWrist()
