"""Commands reach the controller later than they were given."""

from shared.identification.arm.subject import Subject
from shared.identification.dataset.types import Float64
from shared.identification.effect import Quantity, Side
from shared.sim.plant.row import Row
from shared.sim.plant.structure import Structure


class CommandLatency:
    """A transport delay between the log and the controller."""

    name = "command_latency"
    title = "commands reach the controller late"
    signature = "Every channel lags by the same time, so the residual grows with speed."
    side: Side = "command"

    def places(self, subject: Subject) -> tuple[str, ...]:
        """Return the whole arm: one stream of commands has one delay."""
        return ("",)

    def quantities(self, subject: Subject, place: str) -> tuple[Quantity, ...]:
        """Return the delay; by half of its step a simulation is late or early itself."""
        least = 0.5 * subject.plant.timestep
        return (Quantity("delay", "s", 0.0, 0.2, probe=0.01, least=least),)

    def structure(self, subject: Subject, place: str) -> Structure:
        """Return nothing: only the command changes."""
        return ()

    def enter(self, row: Row, place: str, values: Float64) -> None:
        """Delay the commands."""
        row.command = row.command.later(float(values[0]))


EFFECT = CommandLatency()
