"""A study's session on the bus in memory: the real service and the real referee, and somebody who
says what robot_io, a policy and a strap would say; a clock that is moved."""

import functools
import itertools
from pathlib import Path
from typing import Any

import numpy as np

from services.referee.config import RefereeConfig
from services.referee.service import Referee
from services.study.asks import Asks
from services.study.config import StudyConfig
from services.study.course import Terms
from services.study.lsl import Outlet
from services.study.opening import plan_of
from services.study.service import Study, asks_of
from services.study.view import (
    Answer,
    ParticipantAsk,
    ParticipantView,
    Reply,
    ResearcherAsk,
    ResearcherView,
)
from shared.bus.memory import MemoryHub
from shared.clock import ManualClock
from shared.game.bout import Scoreboard
from shared.game.rules import RuleBook
from shared.messages.live import ServiceStatus
from shared.messages.play import (
    BatStates,
    GateReply,
    GateState,
    HeartRate,
    PlayerReply,
    RefereeState,
)
from shared.messages.topics import ARM, BATS, GATE, HEART_RATE, PLAYER, REFEREE, STATUS
from shared.sim.arena import bat_of, target_of
from shared.sim.config import SimConfig
from shared.study.drawing import draw_orders
from shared.study.events import Event
from shared.study.folder import make_study, open_study
from shared.study.journal import Journal, read_journal
from shared.study.recorded import write_participants, write_session

AT = 1.8e9
DT = 0.01
TICK = 5
"""Ticks of the bats between two of the service."""
SHORT = """
schema = 1
name = "short"
title = "A short study"
people = 4
[consent]
text = "We measure your heart."
statements = ["I agree."]
[order]
kind = "fixed"
[[baseline]]
name = "walking"
title = "Walk"
seconds = 3.0
[instruction]
text = "Hit the target."
[explore]
seconds = 2.0
[warm_up]
games = 1
speed = 0.5
player = "scripted:guard"
[game]
seconds = 1.0
[[condition]]
name = "easy"
player = "scripted:guard"
[[condition]]
name = "hard"
player = "scripted:heuristic"
[[section]]
games = 2
rest = 2.0
rest_below = 120.0
instruments = ["mood"]
[[section]]
games = 2
rest = 2.0
instruments = ["comparison"]
[end]
instruments = []
[[instrument]]
name = "mood"
title = "The last games"
[[instrument.item]]
id = "fun"
construct = "enjoyment"
text = "It was fun."
[[instrument]]
name = "comparison"
title = "Compare"
[[instrument.item]]
id = "difficulty"
construct = "difficulty"
text = "How difficult?"
scale = "ranking"
ends = ["least", "most"]
"""


class Pages:
    """Both pages: keeps the views, and what came of asks."""

    def __init__(self) -> None:
        self.researcher: ResearcherView | None = None
        self.participant: ParticipantView | None = None
        self.is_participant_here = True
        self.counters: dict[str, int] = {}
        self.last_refusal = ""

    def show(self, researcher: ResearcherView, participant: ParticipantView) -> None:
        self.researcher, self.participant = researcher, participant

    def close(self) -> None:
        pass


class Stand:
    """A study and everybody it talks to."""

    def __init__(
        self, folder: Path, *, has_tables: bool = False, outlet: Outlet | None = None,
        has_heart_rate: bool = True,
    ) -> None:  # fmt: skip
        """Start everybody; tables are many files, each synced to the disk."""
        self._terms = Terms(countdown=0.5, score_seconds=0.5, has_heart_rate=has_heart_rate)
        self._has_tables = has_tables
        self._outlet = outlet
        self.clock = ManualClock(AT)
        self.hub = MemoryHub(self.clock, max_messages=4096)
        if not (folder / "protocol.toml").exists():
            make_study(folder, SHORT.encode(), "short.toml", "1.0", self.clock)
            draw_orders(folder, 4, 1, self.clock)
        self.folder = folder
        self.study_folder = open_study(folder)
        self.session_folder = self.study_folder.session_folder("sub-01")
        self.robot = self.hub.join("robot-io-0")
        self.robot.declare_alive("robot-io")
        self._policy = self.hub.join("policy-protagonist")
        self._policy.declare_alive("policy")
        self._players = self._policy.answer(PLAYER, agent="protagonist")
        self._gate = self.robot.answer(ARM)
        self._recorder = self.hub.join("recorder-0")
        self._recorder.declare_alive("recorder")
        self.referee: Referee | None = None
        self.start_referee()
        self._said = self.robot.subscribe(REFEREE)
        self.bouts: list[RefereeState] = []
        """The referee's own words: one for every change of bout or phase."""
        self.mode: Any = "disarmed"
        self.is_tracked = True
        self.is_robot_silent = False
        self.rate: float | None = 80.0
        self.refused_player = ""
        self.policy_waits_for = ""
        self.loaded: list[str] = []
        self.gate_asks: list[str] = []
        self.tick_count = 0
        self._ids = itertools.count()
        self.replies: dict[str, Reply] = {}
        self.pages = Pages()
        self.start_study()

    # -- others ---------------------------------------------------------------------------

    def start_referee(self) -> None:
        if self.referee is not None:
            self._referee_bus.close()
        sim = SimConfig()
        judge = functools.partial(Scoreboard, 1, RuleBook(), bat_of(sim), target_of(sim))
        self._referee_bus = self.hub.join("referee-0")
        self._referee_bus.declare_alive("referee")
        self.referee = Referee(RefereeConfig(), judge, DT, self._referee_bus, self.clock)

    def start_study(self) -> None:
        """Start the service; one that was there is as good as killed."""
        cfg = StudyConfig(folder=str(self.folder), participant="sub-01")
        self.journal = Journal(self.session_folder, self.clock)
        self.asks: Asks = asks_of(self.journal)
        self.asks.follow(lambda reply: self.replies.__setitem__(reply.id, reply))
        self.study_bus = self.hub.join("study-0")

        def write_tables() -> None:
            if self._has_tables and self.session.is_over:
                write_session(self.study_folder, "sub-01")
                write_participants(self.study_folder)

        plan = plan_of(self.study_folder, cfg, b"settings")
        self.study = Study(
            plan, self.session_folder, self._terms, self.journal, self.asks, self.pages,
            write_tables, self.study_bus, self.clock, self._outlet,
        )  # fmt: skip
        self.session = self.study.session

    def kill_study(self) -> None:
        """End the service as ``kill -9`` does: nothing is written or said any more."""
        self.journal.close()  # as the kernel does
        self.study_bus.close()

    def tick(self, seconds: float = 0.05) -> None:
        for _ in range(max(round(seconds / (TICK * DT)), 1)):
            for _ in range(TICK):
                self._robot()
                self.clock.advance(DT)
            if self.referee is not None:
                self.referee.tick()
            while (state := self._said.take()) is not None:
                before = self.bouts[-1] if self.bouts else None
                if before is None or (before.bout, before.phase) != (state.bout, state.phase):
                    self.bouts.append(state)
            self.study.tick()
            while (asked := self._players.take()) is not None:
                name = asked.message.player
                is_fine = name != self.refused_player
                if is_fine:
                    self.loaded.append(name)
                reason = "" if is_fine else f"there is no such player: {name!r}"
                asked.reply(PlayerReply(accepted=is_fine, player=name, reason=reason))
            self._answer_gate()
            self._say_how_the_policy_is()

    def _say_how_the_policy_is(self) -> None:
        """As `services.policy` does every second, who plays included."""
        if self.tick_count % 100:
            return
        named = self.loaded[-1] if self.loaded else "scripted:static"
        self._policy.publish(STATUS, ServiceStatus(
            role="policy", name="policy-protagonist", boot=self._policy.boot, pid=1, host="here",
            state=f"{named} plays as protagonist", waiting_for=self.policy_waits_for,
            last_error=f"{named} was late",
        ), role="policy", name="policy-protagonist")  # fmt: skip

    def _robot(self) -> None:
        self.tick_count += 1
        if self.is_robot_silent:
            return
        bats = np.zeros((2, 13))
        bats[:, 0], bats[:, 3] = (0.0, 2.0), 1.0
        bats[:, 2] = 1.0
        say = self.robot.publish
        is_last = self.tick_count % TICK == 0
        if self.session.moment.stage in ("idle", "timer", "form", "score") and not is_last:
            return  # a referee that judges nothing needs no hundred states a second
        say(BATS, BatStates(
            tick=self.tick_count, boot=self.robot.boot, at_ns=self.clock.wall_ns(), bats=bats,
            tools=np.zeros((2, 7)), is_valid=np.array([self.is_tracked, True]), seconds=0.0,
        ))  # fmt: skip
        if is_last:
            say(GATE, GateState(
                tick=self.tick_count, mode=self.mode, reason="", commanded=np.zeros(7),
                is_clipped=False, lateness_ms=0.0, late_ticks=0,
            ))  # fmt: skip
        if self.rate is not None and self.tick_count % 100 == 0:
            say(HEART_RATE, HeartRate(
                at_ns=self.clock.wall_ns(), beats_per_minute=self.rate, source="strap",
            ))  # fmt: skip

    def _answer_gate(self) -> None:
        while (asked := self._gate.take()) is not None:
            action = asked.message.action
            self.gate_asks.append(action)
            reasons = () if self.is_tracked else ("the other bat was not tracked within 0.1 s",)
            if action == "disarm":
                self.mode, reasons = "disarmed", ()
            elif action == "arm" and not reasons:
                self.mode = "armed"
            asked.reply(GateReply(accepted=not reasons, mode=self.mode, reasons=reasons))

    # -- people ---------------------------------------------------------------------------

    def ask(self, action: Any, seconds: float = 0.3, **fields: Any) -> Reply | None:
        """Ask as the researcher, and let time pass until there is an answer."""
        step = self.session.step
        fields.setdefault("step", step.id if step is not None else "")
        fields.setdefault("id", f"r-{next(self._ids)}")
        return self._wait(ResearcherAsk(action=action, **fields), seconds)

    def say(self, action: Any, answers: tuple[Answer, ...] = (), **fields: Any) -> Reply | None:
        """Say something as the participant."""
        step = self.session.step
        fields.setdefault("step", step.id if step is not None else "")
        fields.setdefault("id", f"p-{next(self._ids)}")
        return self._wait(ParticipantAsk(action=action, answers=answers, **fields), 0.3)

    def _wait(self, ask: Any, seconds: float) -> Reply | None:
        known = self.asks.put(ask)
        if known is not None:
            return known
        for _ in range(round(seconds / (TICK * DT))):
            self.tick()
            if ask.id in self.replies:
                return self.replies[ask.id]
        return None

    def until(self, condition: Any, seconds: float = 30.0) -> None:
        for _ in range(round(seconds / (TICK * DT))):
            if condition():
                return
            self.tick()
        raise AssertionError(f"in vain: {self.study.health()}")

    def arm(self) -> None:
        if self.mode != "armed":
            assert self.ask("arm").is_done

    def help_on(self) -> None:
        """Do what the people at both pages have to do now, if anything."""
        session, step = self.session, self.session.step
        if session.progress.state == "new":
            assert self.ask("begin").is_done
        elif step is None:
            return
        elif step.kind == "consent":
            assert self.say("consent").is_done
        elif step.kind in ("instruction", "debrief"):
            assert self.say("ready").is_done
        elif step.kind == "questionnaire":
            assert self.say("answers", (Answer(item="fun", value=4),)).is_done
        elif step.kind == "ranking":
            assert self.say("ranking", (Answer(item="difficulty", ranks=(1, 2)),)).is_done
        elif session.moment.stage == "idle":
            self.arm()
            assert self.ask("begin").is_done

    def walk(self, end: str = "", seconds: float = 200.0) -> None:
        """Go on with all that is needed until a step is on, or until the session is over."""
        for _ in range(round(seconds / (TICK * DT))):
            self.tick()
            step = self.session.step
            if self.session.is_over or (end and step is not None and step.id == end):
                return
            self.help_on()
        raise AssertionError(f"in vain: {self.study.health()}")

    # -- looking --------------------------------------------------------------------------

    @property
    def events(self) -> tuple[Event, ...]:
        return read_journal(self.session_folder)

    def kinds(self, step: str = "") -> list[str]:
        return [event.kind for event in self.events if not step or event.step == step]

    def whats(self, kind: str) -> list[Any]:
        return [event.what for event in self.events if event.kind == kind]
