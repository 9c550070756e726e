"""The tracker sits elsewhere on the tool: another site."""

from shared.sim.hidden.effect import Hidden, whole_arm
from shared.sim.hidden.frames import move_tracked, parts, values

HIDDEN = Hidden(
    name="tool_offset",
    way="another site in the simulator",
    places=whole_arm,
    sizes=lambda scene, place: (2e-4, 0.03),
    values=values,
    enter=lambda robot, case: move_tracked(robot, parts(case)),
)
