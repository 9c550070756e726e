"""Commands get lost while the link to the robot is down."""

from shared.identification.arm.subject import Subject
from shared.identification.dataset.types import Float64
from shared.identification.effect import Quantity, Side
from shared.identification.laws.outages import lost_at, without
from shared.sim.plant.row import Row
from shared.sim.plant.structure import Structure


class DroppedPackets:
    """Commands given in the gaps of the joints' log do not arrive; the last one before holds.

    Commands lost at random leave no trace that says which, so those stay unexplained. But when no
    joint reading came, the same link may have lost the commands, too. Gaps in the commands' own log
    are no effect: the replay holds over them anyway.
    """

    name = "dropped_packets"
    title = "commands are lost while no joint readings arrive"
    signature = "Bursts after the gaps of the joints' log, the larger the faster the command moves."
    side: Side = "command"

    def places(self, subject: Subject) -> tuple[str, ...]:
        """Return the whole arm if commands were given in gaps."""
        is_seen = any(
            lost_at(each.command_at, each.joints_at).any()
            for each in subject.recordings
            if each.split == "train"
        )
        return ("",) if is_seen else ()

    def quantities(self, subject: Subject, place: str) -> tuple[Quantity, ...]:
        """Return how many of the commands given in gaps are lost."""
        return (Quantity("share", "1", 0.0, 1.0, probe=0.5),)

    def structure(self, subject: Subject, place: str) -> Structure:
        """Return nothing: only the command changes."""
        return ()

    def enter(self, row: Row, place: str, values: Float64) -> None:
        """Move the commands given in gaps towards the last one before."""
        row.command = without(row.command, row.logged_q.at, float(values[0]))


EFFECT = DroppedPackets()
