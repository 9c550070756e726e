"""A fake PR2 without wires, and what it said."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from shared.sim.arm import Float64
from shared.testing.fake_pr2.config import FakePr2Config, shipped_parameters
from shared.testing.fake_pr2.jt_cartesian import JtCartesian, JtState, pose_of
from shared.testing.fake_pr2.mechanism import JointStatistics
from shared.testing.fake_pr2.power import PowerState
from shared.testing.fake_pr2.robot import Joints, Robot

CART = "r_cart"


class Heard:
    """What a robot said, with the cycle it was said in."""

    def __init__(self) -> None:
        self.cycle = 0
        self.joints: list[tuple[int, Joints]] = []
        self.states: dict[str, list[tuple[int, JtState]]] = {}
        self.power: list[tuple[int, PowerState]] = []
        self.halted: list[tuple[int, bool]] = []
        self.faults: list[tuple[int, str]] = []
        self.running: list[tuple[int, Mapping[str, bool]]] = []

    def joint_states(self, joints: Joints) -> None:
        self.joints.append((self.cycle, joints))

    def controller_state(self, name: str, state: JtState) -> None:
        self.states.setdefault(name, []).append((self.cycle, state))

    def power_board(self, state: PowerState) -> None:
        self.power.append((self.cycle, state))

    def motors_halted(self, is_halted: bool) -> None:
        self.halted.append((self.cycle, is_halted))

    def diagnostics(self, halted: str) -> None:
        self.faults.append((self.cycle, halted))

    def statistics(
        self, joints: Joints, kept: JointStatistics, running: Mapping[str, bool], is_halted: bool
    ) -> None:  # fmt: skip
        self.running.append((self.cycle, dict(running)))


class Bench:
    """A robot whose parameters are a dictionary."""

    def __init__(self, cfg: FakePr2Config | None = None, **changed: Any) -> None:
        """Start it with ``r_cart`` alone on the arm; ``changed`` are parameters of that."""
        cfg = cfg or FakePr2Config()
        self.parameters = shipped_parameters(cfg)
        self.parameters[CART].update(changed)
        self.heard = Heard()
        self.robot = Robot(cfg, self.heard)
        for name in (*cfg.running, CART):
            assert self.load(name)
        assert self.robot.switch(cfg.running, ())
        assert self.robot.switch((CART,), ("r_arm_controller",))
        self.home = self.pose

    @property
    def pose(self) -> Float64:
        return pose_of(self.robot.mechanism.arm)

    @property
    def cart(self) -> JtCartesian:
        found = self.robot.mechanism.jt(CART)
        assert found is not None
        return found

    @property
    def state(self) -> JtState:
        return self.heard.states[CART][-1][1]

    def load(self, name: str) -> bool:
        return self.robot.load(name, self.parameters.get(name, {}))

    def run(self, seconds: float) -> None:
        for _ in range(round(1000 * seconds)):
            self.heard.cycle += 1
            self.robot.cycle()

    def command(self, *offset: float, name: str = CART, frame: str = "torso_lift_link") -> None:
        """Publish a pose that is off home by x, y and z."""
        pose = self.home.copy()
        pose[: len(offset)] += offset
        self.publish(pose, name, frame)

    def publish(self, pose: Float64, name: str = CART, frame: str = "torso_lift_link") -> None:
        self.robot.command_pose(name, frame, pose, self.robot.mechanism.now)

    def moved(self) -> float:
        """How far the tool is from home (m)."""
        return float(np.linalg.norm(self.pose[:3] - self.home[:3]))
