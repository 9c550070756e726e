"""The tracker's clock runs faster or slower than the robot's."""

from shared.identification.arm.subject import Subject
from shared.identification.dataset.types import Float64
from shared.identification.effect import Quantity, Side
from shared.sim.plant.row import Row
from shared.sim.plant.structure import Structure

_MOST = 5000.0
"""Crystals are within 100 ppm, but stamps by counting frames of a nominal rate are not (ppm)."""
_SEEN = 0.01
"""Lag at the end of a recording that would be noticed (s)."""


class ClockSkew:
    """A rate; the clocks agree at the start of each recording, as a data set says they do.

    What they differ by at the start is ``tracker_latency``: a constant lag and one that grows from
    nothing are told apart within a recording, the better the longer it is.
    """

    name = "clock_skew"
    title = "the tracker's clock runs at another rate"
    signature = "Only the tracker lags, and the lag grows with the time since the start."
    side: Side = "tracker"

    def places(self, subject: Subject) -> tuple[str, ...]:
        """Return the whole arm if a tracker saw it."""
        return ("",) if subject.has_tracker else ()

    def quantities(self, subject: Subject, place: str) -> tuple[Quantity, ...]:
        """Return how much faster the tracker's clock runs."""
        probe = min(max(1e6 * _SEEN / subject.duration, 20.0), 0.4 * _MOST)
        return (Quantity("rate", "ppm", -_MOST, _MOST, probe=probe),)

    def structure(self, subject: Subject, place: str) -> Structure:
        """Return nothing: only the log changes."""
        return ()

    def enter(self, row: Row, place: str, values: Float64) -> None:
        """Stretch the tracker's time about the start of the recording."""
        speed, begin = 1.0 + 1e-6 * float(values[0]), row.begin
        row.warp_tracker(lambda at: (at + begin) / speed - begin)


EFFECT = ClockSkew()
