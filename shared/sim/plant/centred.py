"""Takes damping in the middle of a step, where MuJoCo takes it at the step's end.

MuJoCo's implicit integrators solve (M + h D) v' = M v + h f for the next velocity: first order in
the damping D. With the mean of both velocities it is (M + h D / 2) v' = (M - h D / 2) v + h f,
second order (Crank and Nicolson 1947): the same equation with M - h D / 2 for M. So damping is in
the middle of a step for an arm that has that much less inertia, in its joints and at its tool.
What is left of first order are centrifugal and Coriolis torques, of the speed before a step: half
of the error of a PR2's joints, less of its tool's.

For arms under a pose controller: what a servo's gains do to a light motor at the step that an MJCF
file asks for may not be stable with less inertia.
"""

import numpy as np

from shared.sim.plant.plant import BALANCE
from shared.sim.plant.row import Row

_MOST = 0.9
"""Of an armature that may go: what is left keeps the arm's inertia positive."""
_MOST_OF_TOOL = 0.5
"""Of the tool's mass, and of the smallest armature for its inertia, the same."""


def centre(row: Row) -> None:
    """Take the damping of an arm's joints and of its pose controller in the middle of a step.

    Args:
        row: the arm, with everything in it that changes damping, gains and inertia.
    """
    dofs = row.dofs
    half = 0.5 * row.plant.timestep
    armature = row.field("dof_armature")
    wanted = half * row.current("dof_damping")[dofs]
    armature[dofs] -= np.minimum(wanted, _MOST * armature[dofs])
    body = int(row.model.body(BALANCE).id)
    gains = -row.current("actuator_biasprm")[[row.actuator(index) for index in range(4)], 2]
    tool = float(row.current("body_mass")[row.tool_body()])
    light = float(armature[dofs].min())
    row.field("body_mass")[body] = -min(half * float(gains[:3].mean()), _MOST_OF_TOOL * tool)
    row.field("body_inertia")[body] = -min(half * float(gains[3]), _MOST_OF_TOOL * light)
