"""The tracker's world is not where its calibration says: another site to measure from."""

from shared.sim.hidden.effect import Hidden, whole_arm
from shared.sim.hidden.frames import move_reference, parts, values

HIDDEN = Hidden(
    name="tracker_frame",
    way="another site in the simulator",
    places=whole_arm,
    sizes=lambda scene, place: (2e-4, 0.03),
    values=values,
    enter=lambda robot, case: move_reference(robot, parts(case)),
)
