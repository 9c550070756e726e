"""A live bout in one process: bats that are brought, a referee that judges, a recorder that hears.

What robot_io and the policies would say is made up around recorded bat states; the referee, the
rules and the recorder are the real ones, on the bus in memory with a clock that is moved.
"""

import functools
from pathlib import Path
from typing import Any

import numpy as np

from services.recorder.config import RecorderConfig
from services.recorder.live import about_of
from services.recorder.service import Recorder
from services.referee.config import RefereeConfig
from services.referee.service import Referee
from shared.bus.memory import MemoryHub
from shared.clock import ManualClock
from shared.game.bout import Scoreboard
from shared.game.rules import RuleBook
from shared.messages import topics
from shared.messages.live import ServiceStatus
from shared.messages.play import (
    ArmStates,
    BatStates,
    DesiredOffset,
    GateState,
    HeartRate,
    PlayReply,
    PlayRequest,
    RefereeState,
    TrackerPose,
)
from shared.messages.robot import RobotReport
from shared.messages.tracking import TrackerRaw
from shared.sim.arena import bat_of, target_of
from shared.sim.config import SimConfig
from shared.sim.model import FencingModel

MODEL = FencingModel.build(SimConfig())
RULES = RuleBook(bout_steps=200, camping_steps=30)
ONLY_FILE = RecorderConfig(live=False, min_free_mib=0)
TOOLS = np.array([[0.5, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]] * 2)
BOOT = "0123456789abcdef"


class Fencing:
    """Everything that a live bout says, tick by tick."""

    def __init__(
        self, folder: Path, cfg: RecorderConfig = ONLY_FILE, *, person: bool = False,
        rules: RuleBook = RULES, hub: MemoryHub | None = None,
        clock: ManualClock | None = None,
    ) -> None:  # fmt: skip
        self.clock = clock or ManualClock(1_700_000_000.0)
        self.hub = hub or MemoryHub(self.clock)
        self.bus = self.hub.join("robot-io-0", BOOT)
        sim = SimConfig()
        judge = functools.partial(Scoreboard, 1, rules, bat_of(sim), target_of(sim))
        self.referee = Referee(RefereeConfig(), judge, 0.01, self.hub.join("referee-0"), self.clock)
        self._rules = rules
        self.replace_recorder(folder, cfg)
        self.said = self.bus.subscribe(topics.REFEREE)
        self.person = person
        self.boot = BOOT
        self.tick = -1
        self.is_recorder_held_up = self.is_referee_gone = False
        self.state: RefereeState | None = None

    def replace_recorder(self, folder: Path, cfg: RecorderConfig = ONLY_FILE) -> None:
        """Start a recorder; one that was there must have been closed."""
        folder.mkdir(parents=True, exist_ok=True)
        sections = {"game": self._rules, "sim": SimConfig()}
        about = about_of(folder, MODEL, sections, "ab" * 32)
        bus = self.hub.join("recorder-0")
        self.recorder = Recorder(cfg, bus, self.clock, folder, MODEL, about)

    def bring(self, bats: np.ndarray, *, lost: bool = False, valid: bool = True) -> None:
        """Let one tick pass; a lost one says nothing."""
        self.tick += 1
        if not lost:
            self._say(bats, valid=valid)
        self.clock.advance(0.01)
        if not self.is_referee_gone:
            self.referee.tick()
            if self.tick % 100 == 0:  # as a real bus does every second
                self.bus.publish(topics.REFEREE, self.referee.state())
        if not self.is_recorder_held_up:
            self.recorder.tick()
        while (state := self.said.take()) is not None:
            self.state = state

    def _say(self, bats: np.ndarray, *, valid: bool) -> None:
        tick, boot, now = self.tick, self.boot, self.clock.wall_ns()
        phase = tick / 100.0
        say = self.bus.publish
        say(topics.BATS, BatStates(
            tick=tick, boot=boot, at_ns=now, bats=bats, tools=TOOLS,
            is_valid=np.array([valid, True]), seconds=0.0,
            tracker_source="page" if self.person else "",
            tracker_sequence=tick if self.person else -1,
        ))  # fmt: skip
        joints = MODEL.en_garde + 0.1 * np.sin(phase)
        if self.person:
            joints[0] = 0.0
        say(topics.ARMS, ArmStates(
            tick=tick, boot=boot, is_there=np.array([not self.person, True]), positions=joints,
            velocities=np.full((2, 7), 0.1 * np.cos(phase)),
        ))  # fmt: skip
        say(topics.ROBOT, RobotReport(
            tick=tick, boot=boot, at_ns=now - 3_000_000, speed=0.1, force=2.0 + np.sin(phase),
            effort_share=0.2, is_run_stopped=False, are_motors_halted=False, generation=0,
            efforts=np.arange(7.0),
        ))  # fmt: skip
        for agent in ("antagonist", "protagonist")[self.person :]:
            say(topics.OFFSET, DesiredOffset(
                agent=agent, tick=tick, boot=boot, snapshot="scripted:stab",  # type: ignore[arg-type]
                offset=np.full(6, 0.01 * np.sin(phase)), took_ms=0.5,
            ), agent=agent)  # fmt: skip
        if self.person:
            say(topics.TRACKER, TrackerPose(sequence=tick, source="page", pose=bats[0, :7]))
            say(topics.TRACKER_RAW, TrackerRaw(
                at_ns=now, serial="LHR-1", pose=bats[0, :7], is_valid=valid,
            ))  # fmt: skip
        say(topics.GATE, GateState(
            tick=tick, mode="armed", commanded=TOOLS[1],
            is_clipped=tick % 7 == 0, is_sent=True, lateness_ms=0.2, late_ticks=0,
            answer_ms=None if tick % 5 == 0 else 1.5,
        ))  # fmt: skip
        if tick % 100 == 0:
            say(topics.HEART_RATE, HeartRate(
                at_ns=now, beats_per_minute=90.0 + tick / 100, rr_ms=(660.0, 671.5), source="strap",
            ))  # fmt: skip
            say(topics.STATUS, ServiceStatus(
                role="robot-io", name="robot-io-0", boot=boot, pid=1, host="h", state="armed",
                rates={"lateness_p99_ms": 0.4},
            ), role="robot-io", name="robot-io-0")  # fmt: skip

    def start(self, name: str, first: np.ndarray, ticks: int = 30, **fields: Any) -> None:
        """Show both bats en garde, then start a bout."""
        for _ in range(ticks):
            self.bring(first)
        answer = self.ask("start", name, **fields)
        assert answer.accepted, answer.reason

    def ask(self, action: Any, name: str, **fields: Any) -> PlayReply:
        asked = PlayRequest(
            action=action, bout=name, antagonist="sha256:" + "ab" * 32,
            protagonist="scripted:guard", **fields,
        )  # fmt: skip
        pending = self.bus.ask(topics.BOUT, asked, 1.0)
        self.referee.tick()
        answer = pending.take()
        assert isinstance(answer, PlayReply)
        return answer

    def rest(self, bats: np.ndarray, ticks: int = 150) -> None:
        for _ in range(ticks):
            self.bring(bats)
