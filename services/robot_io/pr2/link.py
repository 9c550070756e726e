"""A PR2 as the loop sees it: newest values in, one command out, nothing that waits."""

import math
from collections.abc import Sequence
from typing import Final

import numpy as np
import structlog

from services.robot_io.links import Floats, RobotState
from services.robot_io.pr2.config import Pr2Config
from services.robot_io.pr2.offset import ClockOffset
from services.robot_io.pr2.parameters import ROOT
from services.robot_io.pr2.power import Board, board_problems, motors_problems
from services.robot_io.pr2.restarts import Restarts
from services.robot_io.pr2.state import (
    NO_POSE,
    BatFrame,
    CartState,
    JointReader,
    JointsState,
    cart_state,
)
from services.robot_io.pr2.watch import Holder, Poller
from shared.clock import Clock
from shared.errors import MessageError
from shared.ros import types
from shared.ros.node import Node

POSE: Final = "geometry_msgs/PoseStamped"
KEPT_STATES: Final = 32
"""Of the 100 states a second, so many are looked at after a pause of the loop."""
LISTED_SECONDS: Final = 4.0
"""The list of controllers may be so old."""
MASTER_SECONDS: Final = 3.0
"""The master may be away for so long before it is a problem."""

log = structlog.get_logger()


class Pr2Link:
    """A robot over ROS; ``read`` and ``write`` belong to one thread."""

    def __init__(
        self, cfg: Pr2Config, frame: BatFrame, joints: Sequence[str], efforts: Sequence[float],
        clock: Clock,
    ) -> None:  # fmt: skip
        """Begin to listen; the robot may come later.

        Args:
            cfg: settings.
            frame: how the bat lies in the world.
            joints: names of the arm's joints, shoulder to wrist.
            efforts: their limits (N m; URDF).
            clock: ours.

        Raises:
            RosError: the master's address or this machine's cannot be.
        """
        self._cfg = cfg
        self._frame = frame
        self._efforts = np.array(efforts)
        self._clock = clock
        self._node = node = Node(cfg.node, cfg.master_uri, cfg.host, clock)
        name = cfg.controller
        self._commands = node.publish_topic(f"/{name}/command_pose", POSE, queue=1)
        self._message = types.new(POSE)
        self._message.header.frame_id = ROOT
        self._states = node.subscribe(
            f"/{name}/state", "robot_mechanism_controllers/JTCartesianControllerState",
            queue=KEPT_STATES,
        )  # fmt: skip
        self._joints = node.subscribe("/joint_states", "sensor_msgs/JointState")
        self._boards = node.subscribe("/power_board/state", "pr2_msgs/PowerBoardState")
        self._motors = node.subscribe("/pr2_ethercat/motors_halted", "std_msgs/Bool")
        self._poller = Poller(node, cfg, joints, efforts, clock)
        self._holder = Holder(node, name)
        self._reader = JointReader(joints)
        self._offset = ClockOffset()
        self._restarts = Restarts(cfg.pose_command_filter)
        self._cart: CartState | None = None
        self._arm: JointsState | None = None
        self._board: Board | None = None
        self._halted: tuple[float, bool] | None = None
        """When the motors were heard of, and whether they are halted."""
        self._starts = 0
        self._was_down = False
        self._is_moved = False
        """Whether a command was sent that the controller has not been told to forget."""
        self._refused = {"state": "", "joints": ""}
        """Why the last of either could not be used; empty if it could."""
        self._mastered_at = clock.now()
        self._generation = 0
        self._counters = {"pr2_commands": 0, "pr2_states_refused": 0}

    def read(self, now: float) -> RobotState:
        """Return the newest state there is; 0.1 ms."""
        self._hear()
        cart, arm, board = self._cart, self._arm, self._board
        is_stopped = board is not None and board.is_stopped
        is_halted = self._halted is not None and self._halted[1]
        self._watch(is_down=is_stopped or is_halted)
        problems = self._problems(now)
        share = None if arm is None else float(np.max(np.abs(arm.efforts) / self._efforts))
        return RobotState(
            at=-math.inf if cart is None or arm is None else min(cart.at, arm.at),
            tool=NO_POSE
            if cart is None
            else np.array([*cart.tool.position, *cart.tool.orientation]),
            speed=0.0 if cart is None else math.hypot(*cart.velocity),
            bat=np.array([*NO_POSE, *[0.0] * 6]) if cart is None else self._frame.state(cart),
            joints=np.zeros(7) if arm is None else arm.positions,
            joint_velocities=np.zeros(7) if arm is None else arm.velocities,
            joint_efforts=None if arm is None else arm.efforts,
            force=cart.force if cart is not None and math.isfinite(cart.force) else None,
            effort_share=share,
            is_run_stopped=is_stopped,
            are_motors_halted=is_halted,
            generation=self._restarts.generation,
            problems=tuple(problems),
            passed=self._passed(now),
        )

    def write(self, pose: Floats) -> None:
        """Send a command that the gate let through."""
        x, y, z, qw, qx, qy, qz = (float(number) for number in pose)
        message = self._message
        message.header.seq = self._counters["pr2_commands"] & 0xFFFFFFFF
        message.header.stamp = types.stamp_of(self._clock.wall_ns())
        place, turn = message.pose.position, message.pose.orientation
        place.x, place.y, place.z = x, y, z
        turn.w, turn.x, turn.y, turn.z = qw, qx, qy, qz
        self._restarts.sent((x, y, z))
        self._is_moved = True
        self._commands.publish(message)
        self._counters["pr2_commands"] += 1

    def hold(self) -> None:
        """Have the controller stay where the arm is, if it was commanded since it last did."""
        if self._is_moved:
            self._is_moved = False
            self._holder.request()

    def rates(self) -> dict[str, float]:
        """Return the offset of the clocks."""
        offset = self._offset.seconds(self._clock.now())
        return {} if offset is None else {"pr2_clock_offset_ms": 1e3 * offset}

    def counters(self) -> dict[str, int]:
        """Return what was counted since the start."""
        readers = (self._states, self._joints, self._boards, self._motors)
        return {
            **self._counters,
            "pr2_commands_dropped": self._commands.dropped,
            "pr2_states": self._states.received,
            "pr2_malformed": sum(reader.malformed for reader in readers),
            "pr2_restarts": self._restarts.generation,
            "pr2_holds": self._holder.holds,
            "pr2_holds_failed": self._holder.failures,
            "pr2_questions_failed": self._poller.failures,
        }

    def close(self) -> None:
        """Let go of the robot, which stays where it is, within some seconds."""
        self._holder.close()
        self._poller.close()
        self._node.close()

    def _hear(self) -> None:
        """Take what has arrived."""
        while (found := self._states.take()) is not None:
            try:
                cart = cart_state(found.message, found.at, ROOT)
            except MessageError as error:
                self._refuse("state", error)
                continue
            self._cart, self._refused["state"] = cart, ""
            self._restarts.observe(cart.stamp, cart.target, cart.filtered)
            self._offset.offer(found.at, 1e-9 * found.wall_ns - cart.stamp)
        if (found := self._joints.take()) is not None:
            try:
                self._arm = self._reader.read(found.message, found.at)
                self._refused["joints"] = ""
            except MessageError as error:
                self._refuse("joints", error)
        if (found := self._boards.take()) is not None:
            self._board = Board.of(found.message, found.at)
        if (found := self._motors.take()) is not None:
            # After a halt it says once more what was before; the power board tells sooner.
            self._halted = (found.at, bool(found.message.data))

    def _refuse(self, what: str, error: MessageError) -> None:
        self._refused[what] = str(error)
        self._counters["pr2_states_refused"] += 1

    def _watch(self, *, is_down: bool) -> None:
        """Begin a new generation when the controller was seen to start, or the motors came back."""
        starts = self._poller.seen.starts
        if starts != self._starts:
            self._starts = starts
            self._restarts.bump("it was started")
        if self._was_down and not is_down:
            self._restarts.bump("the motors came back")  # which restarts every controller
        self._was_down = is_down
        if self._restarts.generation != self._generation:
            self._generation = self._restarts.generation
            log.warning("pr2_controller_restarted", why=self._restarts.reason)

    def _problems(self, now: float) -> list[str]:
        node, seen = self._node, self._poller.seen
        if not node.problem:
            self._mastered_at = now
        elif node.is_shut_down or self._cart is None or now - self._mastered_at > MASTER_SECONDS:
            if self._cart is None:
                return [node.problem]  # of what the rest only follows
            return [node.problem, *self._own_problems(now)]
        problems = [*self._own_problems(now), *seen.problems]
        if now - seen.at > LISTED_SECONDS:
            problems.append(seen.failure or "nobody asks for the controllers any more")
        return problems

    def _own_problems(self, now: float) -> list[str]:
        """Return what the topics tell."""
        cart, cfg = self._cart, self._cfg
        problems = [*board_problems(self._board, now)]
        problems += motors_problems(None if self._halted is None else self._halted[0], now)
        problems += [why for why in self._refused.values() if why]
        if cart is None:
            problems.append(self._states.problem or f"no word from /{cfg.controller}/state yet")
        else:
            if not cart.is_target_finite:
                problems.append(
                    f"the target of {cfg.controller} is not a number: stop and start it"
                )
            if not math.isfinite(cart.force):
                problems.append(f"the force of {cfg.controller} is not a number")
        if self._arm is None:
            problems.append(self._joints.problem or "no word from /joint_states yet")
        if not self._commands.subscribers:
            problems.append(f"nobody listens to /{cfg.controller}/command_pose")
        offset = self._offset.seconds(now)
        if offset is not None and abs(offset) > cfg.clock_offset:
            problems.append(
                f"the robot's clock is {1e3 * offset:+.1f} ms from ours, limit "
                f"{1e3 * cfg.clock_offset:g}: is chrony running on both?"
            )
        if self._holder.problem:
            problems.append(self._holder.problem)
        elif self._holder.is_pending:
            problems.append(f"{cfg.controller} is being told to stay where it is")
        return problems

    def _passed(self, now: float) -> tuple[str, ...]:
        """Return what was looked at and is in order."""
        passed = list(self._poller.seen.passed)
        if not self._node.problem:
            passed.append(f"the ROS master at {self._cfg.master_uri} knows us")
        if self._board is not None and not board_problems(self._board, now):
            passed.append("the power board answers, the right arm has power")
        offset = self._offset.seconds(now)
        if offset is not None and abs(offset) <= self._cfg.clock_offset:
            passed.append(f"the robot's clock is {1e3 * offset:+.1f} ms from ours")
        return tuple(passed)
