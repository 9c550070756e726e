"""What the two adjusters of a PR2 arm's counterbalance do to the torques of its joints.

A spring carries the arm through a gimbal. A technician turns the screw of the secondary spring
and the shaft bar of the arm's gimbal; Willow Garage measured what a turn of each does to the mean
effort that holds shoulder_lift and elbow_flex, on 8 lift by 9 flex angles of a real arm
(pr2_self_test at 886d78c, pr2_counterbalance_check/cb_data/counterbalance_model.dat, BSD). Here is
a least-squares fit of ours to that table, per turn clockwise, of the form that the weight of two
links has::

    a cos(lift) + b sin(lift) + c cos(lift + flex) + d sin(lift + flex)

It leaves 0.011 and 0.043 N m a turn (root mean square) of the lift's spring and bar, 0.004 and
0.018 N m of the flex's, and stays in the measured size outside the table.
"""

from typing import Final

import numpy as np

from shared.identification.dataset.types import Float64

LIFT: Final = "shoulder_lift"
FLEX: Final = "elbow_flex"
SCREW_TOLERANCE: Final = 2.0
"""Turns of the secondary spring that the makers leave as they are (their ``screw_tol``)."""
BAR_TOLERANCE: Final = 0.8
"""Turns of the shaft bar that the makers leave as they are (their ``bar_tol``)."""

_PER_TURN: Final = np.array(
    [
        [[0.2535, 0.0210, 0.0571, 0.0086], [1.1186, -0.0469, -0.0870, -0.0193]],
        [[-0.0011, 0.0033, 0.0661, 0.0015], [0.0109, 0.0108, -0.0281, -0.0207]],
    ]
)
"""float64[joint, adjuster, 4] (N m a turn): lift and flex; spring and bar."""


def effort_per_turn(lift: Float64, flex: Float64) -> Float64:
    """Return float64[..., joint, adjuster]: how much more effort holds the arm after one turn.

    Args:
        lift: float64[...], shoulder_lift (rad).
        flex: float64[...], elbow_flex (rad).

    Returns:
        Efforts of lift and flex, for the secondary spring and the shaft bar (N m a turn clockwise).
    """
    both = lift + flex
    shape = np.stack([np.cos(lift), np.sin(lift), np.cos(both), np.sin(both)], axis=-1)
    return np.einsum("...k,jak->...ja", shape, _PER_TURN)


def turns_of(lift: Float64, flex: Float64, efforts: Float64) -> Float64:
    """Return float64[2], the turns of spring and bar that explain efforts best.

    Args:
        lift: float64[T], postures (rad).
        flex: float64[T] (rad).
        efforts: float64[T, 2], what lift and flex take beyond those of an adjusted arm (N m).
    """
    per_turn = effort_per_turn(lift, flex).reshape(-1, 2)
    return np.asarray(np.linalg.lstsq(per_turn, efforts.reshape(-1))[0], np.float64)
