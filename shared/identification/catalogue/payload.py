"""The tool carries more, or less, than the model says."""

from shared.identification.dataset.types import Float64
from shared.identification.effect import Quantity, Side
from shared.identification.subject import Subject
from shared.sim.plant.plant import is_weightless
from shared.sim.plant.row import Row
from shared.sim.plant.structure import Structure

_GRAVITY = 9.81
"""m/s^2."""


class Payload:
    """A point mass at the tool's centre of mass."""

    name = "payload"
    title = "the tool is heavier than the model says"
    signature = "Inertia and weight grow together, more the further out a joint carries them."
    side: Side = "plant"

    def places(self, subject: Subject) -> tuple[str, ...]:
        """Return the whole arm: the tool is where it is."""
        return ("",)

    def quantities(self, subject: Subject, place: str) -> tuple[Quantity, ...]:
        """Return the mass that the model lacks."""
        return (Quantity("mass", "kg", 0.0, 10.0, probe=0.3),)

    def structure(self, subject: Subject, place: str) -> Structure:
        """Return nothing: the body is there."""
        return ()

    def enter(self, row: Row, place: str, values: Float64) -> None:
        """Make the tool's body heavier, its radius of gyration unchanged.

        The springs of a counterbalanced arm do not know of it: there its weight pulls by itself.
        """
        body = row.tool_body()
        mass = row.field("body_mass")
        if is_weightless(row.model):
            row.weights[body] = _GRAVITY * float(values[0])
        grown = (mass[body] + float(values[0])) / mass[body]
        row.field("body_inertia")[body] *= grown
        mass[body] *= grown


EFFECT = Payload()
