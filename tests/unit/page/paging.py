"""A page's service on the bus in memory, with a window that a test looks through."""

import functools
import json
from collections import deque
from typing import Any

import numpy as np

from services.page import frames
from services.page.config import PageConfig
from services.page.hand import Hand, Reach
from services.page.protocol import Ask, Pointer, parse_ask
from services.page.service import Page
from services.page.tracking import PointerTracker
from shared.bus.memory import MemoryHub
from shared.clock import ManualClock
from shared.game.geometry import BatShape, Target
from shared.messages.play import (
    ArmStates,
    BatStates,
    GateReply,
    GateState,
    PlayerReply,
    PlayReply,
    RefereeState,
    TrackerPose,
)
from shared.messages.topics import ARM, ARMS, BATS, BOUT, GATE, PLAYER, REFEREE, TRACKER


class Window:
    """A browser that a test plays."""

    def __init__(self) -> None:
        self.session = 0
        self.counters: dict[str, int] = {}
        self.last_refusal = ""
        self.frames: list[dict[str, Any]] = []
        self.notes: list[dict[str, Any]] = []
        self.pointer: Pointer | None = None
        self.asks: deque[Ask] = deque()
        self.is_closed = False

    def show(self, frame: bytes) -> None:
        self.frames.append(json.loads(frame))

    def tell(self, note: bytes) -> None:
        self.notes.append(json.loads(note))

    def take_pointer(self) -> Pointer | None:
        pointer, self.pointer = self.pointer, None
        return pointer

    def take_ask(self) -> Ask | None:
        return self.asks.popleft() if self.asks else None

    def close(self) -> None:
        self.is_closed = True


class Paging:
    """The service, its window, and a bench that is referee, policy and robot_io."""

    def __init__(self, **settings: Any) -> None:
        self.clock = ManualClock(10.0)
        hub = MemoryHub(self.clock)
        self.bus, self.bench = hub.join("page-0"), hub.join("bench")
        self.window = Window()
        cfg = PageConfig(**{"countdown": 1.0, "rest": 2.0} | settings)
        hand = Hand(Reach.of(1.0, Target()), BatShape(), cfg.max_speed, cfg.turn_speed)
        hello = functools.partial(frames.hello, cfg, bout_seconds=20.0, rules={"point": 1.0})
        tracker = PointerTracker(hand, self.clock.now(), name=lambda: "mouse")
        self.page = Page(cfg, self.window, tracker, hello, self.bus, self.clock)
        self.course = self.page.course
        self._poses = self.bench.subscribe(TRACKER)
        self.poses: list[TrackerPose] = []
        self._bouts = self.bench.answer(BOUT)
        self._players = self.bench.answer(PLAYER, agent="protagonist")
        self._gate = self.bench.answer(ARM)
        self.bouts: list[tuple[str, str, str, str]] = []
        self.players: list[str] = []
        self.gate_asked: list[str] = []
        self.refuse_bout = self.refuse_player = ""
        self.is_policy_deaf = self.is_referee_slow = False
        self.gate_reply = GateReply(accepted=True, mode="ramping")
        self.ticks = 0
        self.mode: Any = "armed"
        self.is_robot_io_on = True

    def crowd(self, *roles: str) -> "Paging":
        """Let processes of these roles be alive."""
        for role in roles or ("referee", "policy"):
            self.bench.declare_alive(role)
        return self

    def open(self, session: int = 1) -> "Paging":
        self.window.session = session
        return self.tick()

    def wish(self, text: str) -> "Paging":
        self.window.asks.append(parse_ask(text))
        return self.tick(2)

    def tick(self, ticks: int = 1, **states: Any) -> "Paging":
        for _ in range(ticks):
            if self.is_robot_io_on:
                self.publish(**states)
            self.page.tick()
            self._answer()
            self.page.tick()
            while (pose := self._poses.take()) is not None:
                self.poses.append(pose)
            self.clock.advance(0.01)
        return self

    def publish(self, **states: Any) -> None:
        said: dict[str, Any] = {
            "tick": self.ticks, "boot": "io", "at_ns": 0, "bats": np.zeros((2, 13)),
            "tools": np.zeros((2, 7)), "is_valid": np.ones(2, np.bool_), "seconds": 0.0,
        }  # fmt: skip
        self.bench.publish(BATS, BatStates(**said | states))
        zeros = np.zeros((2, 7))
        self.bench.publish(ARMS, ArmStates(
            tick=self.ticks, boot="io", is_there=np.array([False, True]), positions=zeros,
            velocities=zeros,
        ))  # fmt: skip
        self.bench.publish(GATE, GateState(
            tick=self.ticks, mode=self.mode, commanded=np.zeros(7), is_clipped=False,
            lateness_ms=0.0, late_ticks=0,
        ))  # fmt: skip
        self.ticks += 1

    def referee(self, phase: Any, bout: str = "one", **state: Any) -> "Paging":
        """Let the referee say where a bout stands."""
        said: dict[str, Any] = {
            "bout": bout, "phase": phase, "antagonist": "person",
            "protagonist": "scripted:heuristic", "tick": 0, "step": 0, "seconds": 0.0,
            "score": 0.0, "points": 0.0, "in_target": np.zeros(2, np.bool_), "contact": False,
            "attack_steps": 0, "penalty_steps": 0, "camping_steps": 0, "missed_ticks": 0,
            "tone_hz": 0.0,
        }  # fmt: skip
        self.bench.publish(REFEREE, RefereeState(**said | state))
        return self.tick()

    def notes(self, about: str) -> list[dict[str, Any]]:
        return [note for note in self.window.notes if note.get("about") == about]

    def _answer(self) -> None:
        while not self.is_referee_slow and (bout := self._bouts.take()) is not None:
            asked = bout.message
            self.bouts.append((asked.action, asked.bout, asked.antagonist, asked.protagonist))
            accepted = not self.refuse_bout
            bout.reply(PlayReply(accepted=accepted, phase="running", reason=self.refuse_bout))
        while not self.is_policy_deaf and (player := self._players.take()) is not None:
            self.players.append(player.message.player)
            accepted = not self.refuse_player
            player.reply(
                PlayerReply(
                    accepted=accepted, player=player.message.player, reason=self.refuse_player
                )
            )
        while (gate := self._gate.take()) is not None:
            self.gate_asked.append(f"{gate.message.action} by {gate.message.operator}")
            gate.reply(self.gate_reply)
