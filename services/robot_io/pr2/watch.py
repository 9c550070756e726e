"""What takes time: asking the controller manager and the parameter server, and telling to hold.

Two threads, so that an order to hold never waits for a question. They hand over single values
that are replaced whole, so the loop reads without a lock.
"""

import contextlib
import threading
from collections.abc import Sequence
from typing import Any, Final

import msgspec
import structlog

from services.robot_io.pr2.config import Pr2Config
from services.robot_io.pr2.controllers import RUNNING, acts_on, controller_problems
from services.robot_io.pr2.parameters import parameter_problems
from services.robot_io.pr2.power import Diagnostics
from shared.clock import Clock
from shared.ros import types
from shared.ros.errors import RosError
from shared.ros.node import Node

MANAGER: Final = "/pr2_controller_manager"
LIST: Final = "pr2_mechanism_msgs/ListControllers"
SWITCH: Final = "pr2_mechanism_msgs/SwitchController"
STRICT: Final = 2
SERVICE_SECONDS: Final = 1.0
"""Longest wait for one answer."""
POLL_SECONDS: Final = 1.0
GRAPH_POLLS: Final = 5
"""Who else commands is asked every so many polls: the answer tells of the whole robot."""
DIAGNOSTICS_SECONDS: Final = 0.1
RETRY_SECONDS: Final = 0.3
SETTLE_SECONDS: Final = 0.1
"""From the order to hold until the controller's own word of its new target is here."""
CLOSE_SECONDS: Final = 2.5

log = structlog.get_logger()


class Seen(msgspec.Struct, frozen=True, kw_only=True):
    """What was found out on the other threads."""

    at: float = -1e9
    """When the controllers were listed last, by our monotonic clock (s)."""
    failure: str = "the controllers have not been listed yet"
    """Why the last question was not answered; empty if it was."""
    problems: tuple[str, ...] = ()
    passed: tuple[str, ...] = ()
    starts: int = 0
    """How often the controller was seen to run after it did not."""


def running_controllers(node: Node) -> dict[str, bool]:
    """Return all controllers that are loaded, and whether each runs.

    Raises:
        RosError: the controller manager does not answer.
    """
    found = node.call(
        f"{MANAGER}/list_controllers", LIST, types.new(f"{LIST}Request"), SERVICE_SECONDS
    )
    if len(found.controllers) != len(found.state):
        raise RosError("list_controllers answers with names and states that do not match")
    return {
        str(name): str(state) == RUNNING
        for name, state in zip(found.controllers, found.state, strict=True)
    }


class Poller:
    """Asks once a second, and hears the diagnostics."""

    def __init__(
        self, node: Node, cfg: Pr2Config, joints: Sequence[str], efforts: Sequence[float],
        clock: Clock,
    ) -> None:  # fmt: skip
        """Begin to ask.

        Args:
            node: our node.
            cfg: settings.
            joints: names of the arm's joints.
            efforts: their limits (N m).
            clock: ours.
        """
        self.seen = Seen()
        self.failures = 0
        """Questions that were not answered."""
        self._node = node
        self._cfg = cfg
        self._joints = tuple(joints)
        self._efforts = tuple(efforts)
        self._clock = clock
        self._topic = node.subscribe("/diagnostics", "diagnostic_msgs/DiagnosticArray", queue=100)
        self._diagnostics = Diagnostics(cfg.diagnostics_ignored)
        self._acting: dict[str, bool] = {}
        """Whether a controller acts on the arm, by name."""
        self._commanders: tuple[str, ...] = ()
        self._wrong = [f"the parameters of {cfg.controller} have not been read yet"]
        self._was_running = True
        self._polls = 0
        self._said: tuple[str, ...] = ()
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name="pr2-poll", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Stop asking."""
        self._stop.set()
        self._thread.join(CLOSE_SECONDS)

    def _run(self) -> None:
        due, asked = -1e9, Seen()
        while not self._stop.wait(DIAGNOSTICS_SECONDS):
            self._hear_diagnostics()
            if self._clock.now() >= due:
                due = self._clock.now() + POLL_SECONDS
                try:
                    asked = self._ask(asked)
                except RosError as error:
                    self.failures += 1
                    asked = msgspec.structs.replace(asked, failure=str(error))
            errors = self._diagnostics.problems(self._clock.now())
            self.seen = msgspec.structs.replace(asked, problems=(*asked.problems, *errors))
            self._say(self.seen)

    def _ask(self, before: Seen) -> Seen:
        """Return what is wrong, what is not, and how often the controller was seen to start."""
        cfg, node = self._cfg, self._node
        running = running_controllers(node)
        self._acting = {name: acts for name, acts in self._acting.items() if name in running}
        on_arm = [name for name, runs in running.items() if runs and self._acts(name)]
        problems = controller_problems(cfg.controller, running, on_arm)
        is_running = running.get(cfg.controller, False)
        starts = before.starts + (is_running and not self._was_running)
        self._was_running = is_running
        with contextlib.suppress(RosError):  # a master that is away says nothing of the controllers
            self._ask_master()
        others = [name for name in self._commanders if name != node.name]
        rivals = [f"{' and '.join(others)} also commands /{cfg.controller}: end it"] * bool(others)
        passed: list[str] = []
        if not problems:
            passed.append(f"{cfg.controller} runs, alone on the arm")
        if not self._wrong:
            passed.append(f"the parameters of {cfg.controller} are as expected")
        if not rivals:
            passed.append(f"nobody else commands {cfg.controller}")
        return Seen(
            at=self._clock.now(),
            failure="",
            problems=(*problems, *self._wrong, *rivals),
            passed=tuple(passed),
            starts=starts,
        )

    def _ask_master(self) -> None:
        """Read the parameters back, and now and then who commands and where holding is told."""
        cfg, node = self._cfg, self._node
        found = node.param(f"/{cfg.controller}")
        self._wrong = parameter_problems(found, cfg, self._joints, self._efforts)
        if self._polls % GRAPH_POLLS == 0:
            self._commanders = node.publishers_of(f"/{cfg.controller}/command_pose")
            node.locate(f"{MANAGER}/switch_controller")  # to hold without a master
        self._polls += 1

    def _acts(self, name: str) -> bool:
        if name not in self._acting:
            parameters = self._node.param(f"/{name}")
            self._acting[name] = acts_on(name, parameters, self._joints)
        return self._acting[name]

    def _hear_diagnostics(self) -> None:
        while (found := self._topic.take()) is not None:
            self._diagnostics.take(found.message.status, found.at)

    def _say(self, seen: Seen) -> None:
        words = (seen.failure, *seen.problems)
        if words != self._said:
            self._said = words
            log.warning("pr2_problems_changed", failure=seen.failure, problems=list(seen.problems))


class Holder:
    """Tells the controller to stay where the arm is: starting it while it runs re-latches it."""

    def __init__(self, node: Node, controller: str) -> None:
        """Wait for orders.

        Args:
            node: our node.
            controller: that is to hold.
        """
        self.holds = 0
        """Times that it was told, and did."""
        self.failures = 0
        self.problem = ""
        """Why it cannot be told; empty when it can."""
        self._node = node
        self._controller = controller
        self._asked = threading.Event()
        self._done = threading.Event()
        self._done.set()
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name="pr2-hold", daemon=True)
        self._thread.start()

    @property
    def is_pending(self) -> bool:
        """Return whether the controller has not been told yet."""
        return not self._done.is_set()

    def request(self) -> None:
        """Have it hold; returns at once."""
        self._done.clear()
        self._asked.set()

    def close(self) -> None:
        """Wait a moment for what was asked, then end."""
        self._done.wait(CLOSE_SECONDS)
        self._stop.set()
        self._asked.set()
        self._thread.join(CLOSE_SECONDS)

    def _run(self) -> None:
        while not self._stop.is_set():
            self._asked.wait()
            if self._stop.is_set():
                return
            self._asked.clear()
            try:
                self._hold()
            except RosError as error:
                self.failures += 1
                if not self.problem:
                    log.error("pr2_hold_failed", error=str(error))
                self.problem = f"{self._controller} could not be told to hold: {error}"
                self._stop.wait(RETRY_SECONDS)
                self._asked.set()
                continue
            self.problem = ""
            self._stop.wait(SETTLE_SECONDS)
            if not self._asked.is_set():
                self._done.set()

    def _hold(self) -> None:
        # One that is stopped must not be started: another may have the arm.
        if not running_controllers(self._node).get(self._controller, False):
            log.warning("pr2_hold_skipped", controller=self._controller, why="it is not running")
            return
        request: Any = types.new(
            f"{SWITCH}Request", start_controllers=[self._controller], strictness=STRICT
        )
        service = f"{MANAGER}/switch_controller"
        if not self._node.call(service, SWITCH, request, SERVICE_SECONDS).ok:
            raise RosError(f"{service} answers that it did not")
        self.holds += 1
