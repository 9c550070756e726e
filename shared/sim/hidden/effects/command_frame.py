"""Poses are commanded in another frame than the base: another site that servos refer to."""

from shared.sim.hidden.effect import Hidden, Scene
from shared.sim.hidden.frames import move_commands, parts, values


def _places(scene: Scene) -> tuple[str, ...]:
    return ("",) if scene.arm.control == "pose" else ()


HIDDEN = Hidden(
    name="command_frame",
    way="another site in the simulator",
    places=_places,
    sizes=lambda scene, place: (2e-4, 0.03),
    values=values,
    enter=lambda robot, case: move_commands(robot, parts(case)),
)
