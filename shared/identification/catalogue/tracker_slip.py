"""The tracker slips on the tool while it is recorded, and stays there."""

import numpy as np

from shared.identification.dataset.types import Float64
from shared.identification.effect import Quantity, Side
from shared.identification.slips import slip_of
from shared.identification.subject import Subject
from shared.sim.plant.poses import seen_from
from shared.sim.plant.row import Row, TrackerReport
from shared.sim.plant.structure import Structure

_AT = " at "


class TrackerSlip:
    """A step of the tool offset from one instant on, in all recordings made after it, too.

    When it may have been is read from the tracker and the encoders without any simulation; it is
    part of the place: ``swings at 3.520 s``. A slip while a held-out recording was made cannot be
    fitted, and one between two recordings is a ``tool_offset`` of some of them.
    """

    name = "tracker_slip"
    title = "the tracker slipped on the tool"
    signature = "Only the tracker is off, by a step in the hand's frame from one instant on."
    side: Side = "tracker"

    def places(self, subject: Subject) -> tuple[str, ...]:
        """Return the instant of each recording to fit to at which a slip is most likely."""
        if not subject.has_tracker:
            return ()
        found: list[str] = []
        for recording in subject.recordings:
            at = slip_of(subject, recording) if recording.split == "train" else None
            if at is not None:
                found.append(f"{recording.name}{_AT}{at:.3f} s")
        return tuple(found)

    def quantities(self, subject: Subject, place: str) -> tuple[Quantity, ...]:
        """Return the way in the hand's frame."""
        return tuple(Quantity(axis, "m", -0.1, 0.1, probe=0.005) for axis in "xyz")

    def structure(self, subject: Subject, place: str) -> Structure:
        """Return nothing: only the log changes."""
        return ()

    def enter(self, row: Row, place: str, values: Float64) -> None:
        """Move the tracker on the tool from the instant on."""
        recording, _, at = place.rpartition(_AT)
        if recording == row.trajectory:
            since = float(at.removesuffix(" s")) - row.begin
        elif recording in row.earlier:
            since = -np.inf
        else:
            return
        slipped = np.concatenate([values, [1.0, 0.0, 0.0, 0.0]])

        def change(report: TrackerReport) -> None:
            late = report.at >= since
            report.pose[late] = seen_from(report.pose[late], slipped)

        row.on_tracker(change)


EFFECT = TrackerSlip()
