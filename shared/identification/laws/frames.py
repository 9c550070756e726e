"""The six numbers by which a frame is off."""

from shared.identification.effect import Quantity
from shared.sim.arm import Float64
from shared.sim.plant.poses import inverse, seen_from
from shared.sim.plant.row import Row, TrackerReport

_SHIFT = 0.3
"""Farther off, a frame is not wrong but another one (m)."""
_TURN = 0.5
"""(rad)."""


def frame_quantities() -> tuple[Quantity, ...]:
    """Return translation and rotation vector, in the order of :func:`shared.sim.plant.poses.frame`.

    5 mm and 10 mrad are what a careful calibration by hand leaves.
    """
    return (
        *(Quantity(axis, "m", -_SHIFT, _SHIFT, probe=0.005) for axis in "xyz"),
        *(Quantity(f"turn_{axis}", "rad", -_TURN, _TURN, probe=0.01) for axis in "xyz"),
    )


def move_hand(row: Row, frame: Float64) -> None:
    """Let the tracker sit elsewhere on the tool: float64[7], where in the frame it should be at."""

    def change(report: TrackerReport) -> None:
        report.pose = seen_from(report.pose, frame)

    row.on_tracker(change)


def move_world(row: Row, frame: Float64) -> None:
    """Let the tracker's base frame be elsewhere: float64[7], its pose in the model's."""
    back = inverse(frame)

    def change(report: TrackerReport) -> None:
        report.pose = seen_from(back, report.pose)

    row.on_tracker(change)
