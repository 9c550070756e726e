"""The tracker's poses are older, or newer, than their time stamps say."""

from shared.identification.arm.subject import Subject
from shared.identification.dataset.types import Float64
from shared.identification.effect import Quantity, Side
from shared.sim.plant.row import Row
from shared.sim.plant.structure import Structure


class TrackerLatency:
    """A constant difference between the tracker's clock and the log's.

    A transport delay and clocks that were set differently are the same thing in the data, so the
    delay may be negative. Clocks that drift apart are ``clock_skew``.
    """

    name = "tracker_latency"
    title = "the tracker's poses are late"
    signature = "Only the tracker lags, by the same time throughout; the encoders are right."
    side: Side = "tracker"

    def places(self, subject: Subject) -> tuple[str, ...]:
        """Return the whole arm if a tracker saw it."""
        return ("",) if subject.has_tracker else ()

    def quantities(self, subject: Subject, place: str) -> tuple[Quantity, ...]:
        """Return the delay; a tenth of a second is a very slow tracker."""
        return (Quantity("delay", "s", -0.1, 0.3, probe=0.01),)

    def structure(self, subject: Subject, place: str) -> Structure:
        """Return nothing: only the log changes."""
        return ()

    def enter(self, row: Row, place: str, values: Float64) -> None:
        """Let what is stamped now have been seen a while ago."""
        delay = float(values[0])
        row.warp_tracker(lambda at: at - delay)


EFFECT = TrackerLatency()
