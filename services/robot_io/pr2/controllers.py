"""Which controllers act on the arm: ``pr2_controller_manager`` lets two of them fight."""

from collections.abc import Mapping, Sequence
from typing import Any, Final

RUNNING: Final = "running"


def acts_on(name: str, parameters: Any, joints: Sequence[str]) -> bool:
    """Return whether a controller puts efforts on the arm.

    One of which nothing is known is taken to, where its name says that it is of this side and
    not of its gripper.

    Args:
        name: of the controller.
        parameters: what the parameter server has under that name; None where it has nothing.
        joints: of the arm.
    """
    side = joints[0].split("_", 1)[0] + "_"
    by_name = name.startswith(side) and not name.startswith(f"{side}gripper")
    if not isinstance(parameters, Mapping):
        return by_name
    found: Mapping[str, Any] = parameters  # pyright: ignore[reportUnknownVariableType]
    named = {str(found.get("joint", ""))}
    listed = found.get("joints", ())
    if isinstance(listed, list | tuple):
        named |= {_joint_name(one) for one in listed}  # pyright: ignore[reportUnknownVariableType]
    if named != {""}:
        return bool(named & set(joints))
    ends = str(found.get("tip_name", found.get("tip_link", "")))
    return ends.startswith(side) if ends else by_name


def _joint_name(one: Any) -> str:
    """Return the name of a joint: a text, or a table with one."""
    return str(one.get("name", "")) if isinstance(one, Mapping) else str(one)  # pyright: ignore


def controller_problems(name: str, running: Mapping[str, bool], on_arm: Sequence[str]) -> list[str]:
    """Return what is wrong with the controllers.

    Args:
        name: of the one that is commanded.
        running: every controller that is loaded, and whether it runs.
        on_arm: those that run and act on the arm.
    """
    problems: list[str] = []
    if name not in running:
        problems.append(f"the controller {name} is not loaded: roslaunch the JT controllers")
    elif not running[name]:
        problems.append(
            f"the controller {name} is not running: start it, and stop r_arm_controller"
        )
    if others := [one for one in on_arm if one != name]:
        problems.append(
            f"{' and '.join(others)} also runs on the arm, and efforts add up: stop it "
            "(rosrun pr2_controller_manager pr2_controller_manager stop NAME)"
        )
    return problems
