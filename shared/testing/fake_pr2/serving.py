"""The services of the controller manager, the motors and the power board."""

from typing import Any, Final, Protocol

from shared.ros import types
from shared.ros.node import Node

NODE: Final = "/pr2_ethercat"
MANAGER: Final = "/pr2_controller_manager"
_OF_MANAGER: Final = "pr2_mechanism_msgs"


class Served(Protocol):
    """A robot that does what is asked of it, in one cycle each."""

    def controllers(self) -> dict[str, bool]:
        """Return the controllers that are loaded, and whether each runs."""
        ...

    def load(self, name: str) -> bool:
        """Load a controller."""
        ...

    def unload(self, name: str) -> bool:
        """Unload a controller."""
        ...

    def switch(self, start: list[str], stop: list[str], strictness: int = 2) -> bool:
        """Stop and start controllers."""
        ...

    def halt_motors(self, reason: str = ...) -> None:
        """Halt the motors."""
        ...

    def reset_motors(self) -> None:
        """Bring the motors back."""
        ...

    def set_circuit(self, circuit: int, *, is_on: bool) -> bool:
        """Give the power to a circuit, or take it."""
        ...


def serve(node: Node, robot: Served) -> None:
    """Answer all of them on a node, until that is closed."""

    def list_controllers(request: Any) -> Any:
        del request
        found = robot.controllers()
        states = ["running" if runs else "stopped" for runs in found.values()]
        return types.new(
            f"{_OF_MANAGER}/ListControllersResponse", controllers=list(found), state=states
        )

    def load(request: Any) -> Any:
        return types.new(f"{_OF_MANAGER}/LoadControllerResponse", ok=robot.load(request.name))

    def unload(request: Any) -> Any:
        return types.new(f"{_OF_MANAGER}/UnloadControllerResponse", ok=robot.unload(request.name))

    def switch(request: Any) -> Any:
        done = robot.switch(
            list(request.start_controllers), list(request.stop_controllers), request.strictness
        )
        return types.new(f"{_OF_MANAGER}/SwitchControllerResponse", ok=done)

    def halt(request: Any) -> Any:
        del request
        robot.halt_motors("service request")
        return types.new("std_srvs/EmptyResponse")

    def reset(request: Any) -> Any:
        del request
        robot.reset_motors()
        return types.new("std_srvs/EmptyResponse")

    def control(request: Any) -> Any:
        done = request.command in ("start", "stop", "disable") and robot.set_circuit(
            request.breaker_number, is_on=request.command == "start"
        )
        return types.new("pr2_power_board/PowerBoardCommandResponse", retval=0 if done else -1)

    node.serve(f"{MANAGER}/list_controllers", f"{_OF_MANAGER}/ListControllers", list_controllers)
    node.serve(f"{MANAGER}/load_controller", f"{_OF_MANAGER}/LoadController", load)
    node.serve(f"{MANAGER}/unload_controller", f"{_OF_MANAGER}/UnloadController", unload)
    node.serve(f"{MANAGER}/switch_controller", f"{_OF_MANAGER}/SwitchController", switch)
    node.serve(f"{NODE}/halt_motors", "std_srvs/Empty", halt)
    node.serve(f"{NODE}/reset_motors", "std_srvs/Empty", reset)
    node.serve("/power_board/control", "pr2_power_board/PowerBoardCommand", control)
