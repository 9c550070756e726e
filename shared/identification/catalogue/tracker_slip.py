"""The tracker slips on the tool while it is recorded, and stays there."""

import numpy as np

from shared.identification.arm.subject import Subject
from shared.identification.dataset.types import Float64
from shared.identification.effect import Quantity, Side
from shared.sim.plant.poses import rotated
from shared.sim.plant.row import Row, TrackerReport
from shared.sim.plant.structure import Structure


class TrackerSlip:
    """A step of the tool offset from one instant on, in all recordings made after it, too.

    The instant is looked for near those at which tracker and encoders, without any simulation,
    part by the clearest steps. A slip while a held-out recording was made cannot be fitted, and one
    between two recordings is a ``tool_offset`` of some of them.
    """

    name = "tracker_slip"
    title = "the tracker slipped on the tool"
    signature = "Only the tracker is off, by a step in the hand's frame from one instant on."
    side: Side = "tracker"

    def places(self, subject: Subject) -> tuple[str, ...]:
        """Return the recordings to fit to that have a step."""
        return tuple(subject.slips) if subject.has_tracker else ()

    def quantities(self, subject: Subject, place: str) -> tuple[Quantity, ...]:
        """Return the way in the hand's frame, and when, on the tracker's clock."""
        times = subject.slips.get(place, (0.5 * subject.duration,))
        return (
            *(Quantity(axis, "m", -0.1, 0.1, probe=0.005) for axis in "xyz"),
            Quantity("time", "s", 0.0, max(subject.duration, *times), probe=0.1, grid=times),
        )

    def structure(self, subject: Subject, place: str) -> Structure:
        """Return nothing: only the log changes."""
        return ()

    def enter(self, row: Row, place: str, values: Float64) -> None:
        """Move the tracker on the tool from the instant on."""
        if place == row.trajectory:
            since = float(values[3]) - row.begin
        elif place in row.earlier:
            since = -np.inf
        else:
            return
        way = values[:3]

        def change(report: TrackerReport) -> None:
            # The reading nearest to the slip shares it, so that the time has a derivative.
            period = float(np.median(np.diff(report.at))) if len(report.at) > 1 else 1.0
            share = np.clip((report.at - since) / period + 0.5, 0.0, 1.0)[:, None]
            report.pose[:, :3] += share * rotated(report.pose[:, 3:], way)

        row.on_tracker(change)


EFFECT = TrackerSlip()
