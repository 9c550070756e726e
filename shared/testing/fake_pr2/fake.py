"""A fake PR2 in real time on a ROS master: one thread for the robot, one for its sockets.

What a test or a person does to it goes through the methods here; what a program does to it, over
ROS. All of it may be called from any thread.
"""

import contextlib
import threading
from collections import deque
from dataclasses import dataclass
from typing import Any, Final, cast

import numpy as np

from shared.clock import Clock, SystemClock
from shared.errors import RobotFault
from shared.ros.node import Node
from shared.sim.arm import Float64
from shared.sim.servo import CYCLE
from shared.testing.fake_pr2.config import FakePr2Config, shipped_parameters
from shared.testing.fake_pr2.jt_cartesian import JtCartesian, pose_of
from shared.testing.fake_pr2.power import CIRCUITS
from shared.testing.fake_pr2.robot import Robot
from shared.testing.fake_pr2.ros_side import Wires, pose_in
from shared.testing.fake_pr2.serving import NODE, serve
from shared.testing.ros_master import RosMaster

MOST_CYCLES: Final = 20
"""Made up for without letting anybody else in."""
MOST_BEHIND: Final = 200
"""Cycles; time beyond that is lost to the robot, and counted."""
REMEMBERED: Final = 60_000
"""Of the arm 100 a second, of commands as many as came."""
_WAKE_SECONDS: Final = 0.002


@dataclass(frozen=True)
class ArmMoment:
    """Where the arm was, 100 times a second."""

    at: float
    """By the clock (s)."""
    tool: Float64
    """float64[7], position (m) and quaternion (w, x, y, z) in the torso frame."""
    velocity: Float64
    """float64[3] of the tool (m/s)."""
    efforts: Float64
    """float64[7], measured (N m)."""
    force: Float64
    """float64[6] that running Cartesian controllers put on the tool, linear first (N, N m)."""


@dataclass(frozen=True)
class HeardCommand:
    """A pose that somebody published for a controller."""

    at: float
    """By the clock (s)."""
    controller: str
    frame: str
    pose: Float64
    """float64[7], as it came."""


class FakePr2:
    """A robot that is there from construction until it is closed."""

    def __init__(
        self, cfg: FakePr2Config | None = None, clock: Clock | None = None, *,
        is_driven: bool = False,
    ) -> None:  # fmt: skip
        """Start a master, the robot's parameters, node and services, and the robot itself.

        Args:
            cfg: settings.
            clock: the robot's; this machine's if None.
            is_driven: whether whoever moves the clock also calls ``catch_up``; else it keeps up
                by itself.

        Raises:
            ConfigError: Debian's rosmaster is not installed, the port is taken, or the model that
                ``cfg`` names cannot be used.
        """
        self.cfg = cfg or FakePr2Config()
        self._clock = clock or SystemClock()
        self._lock = threading.Lock()
        self._stop = threading.Event()
        self._moments: deque[ArmMoment] = deque(maxlen=REMEMBERED)
        self._commands: deque[HeardCommand] = deque(maxlen=REMEMBERED)
        self.cycles_lost = 0
        """Milliseconds that this machine was too slow for."""
        with contextlib.ExitStack() as undo:
            self._master = RosMaster(self.cfg.port)
            undo.callback(self._master.close)
            self._node = Node(NODE, self._master.uri, clock=self._clock)
            undo.callback(self._node.close)
            for namespace, values in shipped_parameters(self.cfg).items():
                self._node.set_param(f"/{namespace}", values)
            self._wires = Wires(self._node, self._wall_ns, self.cfg.sim.torso_lift)
            self._robot = Robot(self.cfg, self._wires)
            self._began_at, self._began_ns = self._clock.now(), self._clock.wall_ns()
            self._lost_seconds = 0.0
            self._frozen_at: float | None = None
            for name in self.cfg.running:
                if self.load(name):
                    self.switch([name], [])
            serve(self._node, self)
            self._node.wait_registered(5.0)
            undo.pop_all()
        self._thread = threading.Thread(target=self._run, name="fake-pr2", daemon=True)
        if not is_driven:
            self._thread.start()

    @property
    def master_uri(self) -> str:
        """Return what a ROS node takes as ROS_MASTER_URI."""
        return self._master.uri

    def press_run_stop(self) -> None:
        """Press the button on the robot's back."""
        self._set_power(is_pressed=True)

    def release_run_stop(self) -> None:
        """Let the button out again."""
        self._set_power(is_pressed=False)

    def press_wireless_stop(self) -> None:
        """Press the button in the operator's hand."""
        self._set_power(is_wireless_pressed=True)

    def release_wireless_stop(self) -> None:
        """Let the button out again."""
        self._set_power(is_wireless_pressed=False)

    def halt_motors(self, reason: str = "a device failed") -> None:
        """Halt the motors, as a fault of the hardware does."""
        with self._lock:
            self._robot.halt_motors(reason)

    def reset_motors(self) -> None:
        """Bring the motors back, where they have power."""
        with self._lock:
            self._robot.reset_motors()

    def block(self, is_blocked: bool) -> None:
        """Hold the joints where they are, or let them go."""
        with self._lock:
            self._robot.mechanism.arm.is_blocked = is_blocked

    def push(self, *force: float) -> None:
        """Pull at the tool from now on: x, y and z in the torso frame (N); zeros let go."""
        with self._lock:
            self._robot.mechanism.arm.push(np.array(force))

    def put_back(self) -> None:
        """Put the arm en garde by hand; what runs on it holds it there."""
        with self._lock:
            self._robot.mechanism.arm.put_back()
            self._robot.switch(self._running(), [])

    def mute(self, *topics: str) -> None:
        """Publish nothing on these topics, and on all others again."""
        with self._lock:
            self._wires.muted = frozenset(topics)

    def freeze(self) -> None:
        """Stop the robot's computer: no cycle, no message, until ``thaw``."""
        with self._lock:
            self._frozen_at = self._clock.now()

    def thaw(self) -> None:
        """Let it go on; the time in between never was."""
        with self._lock:
            if self._frozen_at is not None:
                self._lost_seconds += self._clock.now() - self._frozen_at
                self._frozen_at = None

    def load(self, name: str) -> bool:
        """Load a controller from the parameter server; False where it cannot be, or is there."""
        found = self._node.param(f"/{name}")
        parameters = cast("dict[str, Any]", found) if isinstance(found, dict) else {}
        with self._lock:
            if not self._robot.load(name, parameters):
                return False
            if isinstance(self._robot.mechanism.controllers[name], JtCartesian):
                self._wires.add_cart(name)
            return True

    def switch(self, start: list[str], stop: list[str], strictness: int = 2) -> bool:
        """Stop and start controllers in one cycle; False changes nothing."""
        with self._lock:
            return self._robot.switch(start, stop, strictness)

    def unload(self, name: str) -> bool:
        """Unload a controller; False where there is none, or it runs."""
        with self._lock:
            return self._robot.mechanism.unload(name)

    def controllers(self) -> dict[str, bool]:
        """Return the names of the controllers that are loaded, and whether each runs."""
        with self._lock:
            found = self._robot.mechanism.controllers
            return {name: controller.is_running for name, controller in found.items()}

    def set_circuit(self, circuit: int, *, is_on: bool) -> bool:
        """Give the power to a circuit, or take it; False where that cannot be."""
        with self._lock:
            power = self._robot.power
            if not 0 <= circuit < CIRCUITS:
                return False
            if is_on:
                return power.start_circuit(circuit, self._robot.mechanism.now)
            power.stop_circuit(circuit)
            return True

    def add_rival(self, name: str) -> bool:
        """Load and start a second Cartesian controller on the arm, with the first one's numbers."""
        cart = self._node.param(f"/{self.cfg.prefix}cart", {})
        self._node.set_param(f"/{name}", cart)
        return self.load(name) and self.switch([name], [])

    def set_up(self) -> None:
        """Do what docs/robot.md says is to be done on the robot after its start.

        Half the force, torques bounded, and the Cartesian controller in the place of the one that
        holds the arm.

        Raises:
            RobotFault: the Cartesian controller is loaded already.
        """
        prefix = self.cfg.prefix
        cart = f"{prefix}cart"
        arm = self._robot.mechanism.arm.arm
        most = {f"{prefix}{joint.name}_joint": joint.continuous_torque for joint in arm.joints}
        self._node.set_param(f"/{cart}/vel_saturation_trans", 1.0)
        self._node.set_param(f"/{cart}/saturation", most)
        if not (self.load(cart) and self.switch([cart], [f"{prefix}arm_controller"])):
            raise RobotFault(f"the fake PR2 could not start {cart}: is it loaded already?")

    def set_param(self, name: str, value: Any) -> None:
        """Set a parameter on the master."""
        self._node.set_param(name, value)

    def running(self) -> tuple[str, ...]:
        """Return the names of the controllers that run."""
        return tuple(name for name, runs in self.controllers().items() if runs)

    @property
    def is_halted(self) -> bool:
        """Return whether the motors are halted, in truth."""
        return self._robot.power.is_halted

    def tool(self) -> Float64:
        """Return float64[7], where the tool is now."""
        with self._lock:
            return pose_of(self._robot.mechanism.arm)

    def moments(self, since: float = -np.inf) -> list[ArmMoment]:
        """Return where the arm was since an instant of the clock, oldest first."""
        with self._lock:
            return [moment for moment in self._moments if moment.at >= since]

    def commands(self, since: float = -np.inf) -> list[HeardCommand]:
        """Return the poses that were published for controllers since an instant, oldest first."""
        with self._lock:
            return [command for command in self._commands if command.at >= since]

    def close(self) -> None:
        """Stop it and its master; a second call does nothing."""
        if self._stop.is_set():
            return
        self._stop.set()
        if self._thread.is_alive():
            self._thread.join(5.0)
        self._node.close()
        self._master.close()

    def __enter__(self) -> "FakePr2":
        return self

    def __exit__(self, *exception: object) -> None:
        self.close()

    def catch_up(self) -> None:
        """Make all the cycles that are due."""
        while self._catch_up():
            pass

    def _run(self) -> None:
        while not self._stop.wait(_WAKE_SECONDS):
            self.catch_up()

    def _catch_up(self) -> bool:
        """Make some of the cycles that are due; return whether more are."""
        with self._lock:
            if self._frozen_at is not None:
                return False
            now = self._clock.now()
            self._hear()
            mechanism = self._robot.mechanism
            due = int(self._time_at(now) / CYCLE + 1e-6) - mechanism.cycles
            if due > MOST_BEHIND:
                lost = due - MOST_BEHIND
                self.cycles_lost += lost
                self._lost_seconds += lost * CYCLE
                due = MOST_BEHIND
            for _ in range(min(due, MOST_CYCLES)):
                self._robot.cycle()
                if mechanism.cycles % 10 == 0:
                    self._remember()
            return due > MOST_CYCLES and not self._stop.is_set()

    def _time_at(self, now: float) -> float:
        """Return an instant of the clock on the robot's own time."""
        return now - self._began_at - self._lost_seconds

    def _instant(self) -> float:
        """Return the robot's own time on the clock."""
        return self._began_at + self._lost_seconds + self._robot.mechanism.now

    def _wall_ns(self) -> int:
        """Return the wall clock at the robot's cycle, which may be a little behind."""
        return self._began_ns + round(1e9 * (self._instant() - self._began_at))

    def _remember(self) -> None:
        mechanism = self._robot.mechanism
        arm = mechanism.arm
        self._moments.append(
            ArmMoment(
                at=self._instant(),
                tool=pose_of(arm),
                velocity=arm.jacobian[:3] @ arm.qd,
                efforts=mechanism.measured.copy(),
                force=mechanism.cart_force(),
            )
        )

    def _running(self) -> list[str]:
        found = self._robot.mechanism.controllers
        return [name for name, controller in found.items() if controller.is_running]

    def _hear(self) -> None:
        """Take what was published for the controllers."""
        for name, topics in self._wires.carts.items():
            while (received := topics.pose.take()) is not None:
                frame, pose = pose_in(received)
                self._commands.append(HeardCommand(received.at, name, frame, pose))
                self._robot.command_pose(name, frame, pose, self._time_at(received.at))
            controller = self._robot.mechanism.jt(name)
            if controller is None:
                continue
            while (received := topics.posture.take()) is not None:
                controller.command_posture(np.asarray(received.message.data, np.float64))
            while (received := topics.gains.take()) is not None:
                controller.set_gains(np.asarray(received.message.data, np.float64))

    def _set_power(self, **pressed: bool) -> None:
        with self._lock:
            for name, value in pressed.items():
                setattr(self._robot.power, name, value)
