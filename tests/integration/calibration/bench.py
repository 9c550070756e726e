"""A twin whose gripper carries a tracker of a SteamVR that is none, and somebody's hand on it."""

from collections.abc import Sequence

import numpy as np
from scipy.spatial.transform import Rotation

from services.robot_io.__main__ import twin_parts
from services.robot_io.config import RobotIoConfig, SafetyConfig
from services.robot_io.poses import Pose
from services.robot_io.service import RobotIo
from services.robot_io.trackers import Tracker
from services.robot_io.twin import TwinLink
from services.robot_io.vive.config import ViveConfig
from services.robot_io.vive.device import ViveDevice
from services.robot_io.vive.source import ViveSource
from services.robot_io.vive.tracker import ViveTracker
from shared.bus.memory import MemoryHub
from shared.clock import ManualClock
from shared.messages.play import BatStates, GateReply, GateRequest
from shared.messages.topics import ARM, BATS
from shared.sim.config import SimConfig
from shared.testing.fake_vive.runtime import FakeVive

SLOT = 2
DEGREES = 35.0
REACH = 0.12


def matrix_of(pose: Sequence[float] | np.ndarray) -> np.ndarray:
    """Return float64[4, 4] of position and quaternion."""
    matrix = np.eye(4)
    matrix[:3, :3] = Rotation.from_quat(pose[3:7], scalar_first=True).as_matrix()
    matrix[:3, 3] = pose[:3]
    return matrix


class Bench:
    """robot_io on a twin, in a time that the test moves, with the real openvr wheel."""

    def __init__(
        self, vive: FakeVive, cfg: ViveConfig, rng: np.random.Generator, began: float
    ) -> None:
        self.clock = ManualClock(began)
        self.hub = MemoryHub(self.clock)
        self.bus, self.desk = self.hub.join("robot-io-0"), self.hub.join("desk")
        self.bats = self.desk.subscribe(BATS)
        self._vive, self._cfg, self._rng = vive, cfg, rng
        self.source = ViveSource(ViveDevice(), cfg.serial, self.clock)
        robot = RobotIoConfig(tracker="vive", twin_filter=1.0, twin_delay=0.0, twin_force=60.0)
        self.parts = twin_parts(robot, SafetyConfig(), SimConfig(), self.bus, self._open)
        assert isinstance(self.parts.link, TwinLink)
        self.link = self.parts.link
        self.service = RobotIo(robot, self.parts, 0.01, self.bus, self.clock)
        self.tool = np.array([*self.parts.home.position, *self.parts.home.orientation])
        self.states: BatStates | None = None

    def _open(self, world_from_torso: Pose, start: Pose) -> Tracker:
        self.world_from_torso = matrix_of(
            [*world_from_torso.position, *world_from_torso.orientation]
        )
        return ViveTracker(self._cfg, self.source, world_from_torso, start, self.bus, self.clock)

    def tick(self, tracker: np.ndarray) -> None:
        """Go on by 10 ms, the tracker at float64[4, 4] in the base stations' frame."""
        self._vive.put(SLOT, self._cfg.serial, tracker)
        for _ in range(2):
            self.source.poll()
            self.clock.advance(0.004)
        self.clock.advance(0.002)
        self.service.tick()
        while (states := self.bats.take()) is not None:
            self.states = states
            self.tool = states.tools[1]
        self.service.tick()

    def travel(self, target: np.ndarray, seconds: float = 1.8) -> None:
        """Move the gripper as a hand would, unwatched: only the physics goes on."""
        self.link.write(target)
        for _ in range(round(seconds / 0.1)):
            self.clock.advance(0.1)
            self.link.read(self.clock.now())

    def ask(self, action: str) -> GateReply:
        asked = GateRequest(action=action, operator="test")  # type: ignore[arg-type]
        pending = self.desk.ask(ARM, asked, timeout=1.0)
        self.service.tick()
        reply = pending.take()
        assert isinstance(reply, GateReply)
        return reply

    def another_pose(self) -> np.ndarray:
        """Return float64[7], a tool pose around en garde, as a person might take the gripper."""
        home = self.parts.home
        turn = Rotation.from_rotvec(np.deg2rad(self._rng.uniform(-DEGREES, DEGREES, 3)))
        there = turn * Rotation.from_quat(home.orientation, scalar_first=True)
        place = np.array(home.position) + self._rng.uniform(-REACH, REACH, 3)
        return np.concatenate([place, there.as_quat(scalar_first=True)])

    def noise(self, metres: float, degrees: float) -> np.ndarray:
        """Return a small random motion, float64[4, 4]."""
        matrix = np.eye(4)
        off = Rotation.from_rotvec(np.deg2rad(self._rng.normal(0.0, degrees, 3)))
        matrix[:3, :3], matrix[:3, 3] = off.as_matrix(), self._rng.normal(0.0, metres, 3)
        return matrix

    def close(self) -> None:
        self.service.close()
