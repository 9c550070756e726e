"""A match of two policies on the simulated robot, watched while faults strike it.

The watcher is the operator: after a trip it waits, sees that nothing moves, and arms again, as a
person would. What it checks of the commands it reads from what robot_io says it sent, against the
numbers of ``[safety]``, with none of the gate's own code.
"""

import contextlib
from collections import Counter, deque
from collections.abc import Callable
from dataclasses import replace
from typing import Any, TypeVar

import numpy as np

from services.jobs.chaos.faults import Blow
from services.jobs.chaos.job import FINISH_SECONDS, POLL_SECONDS, Job, JobEnded
from services.jobs.chaos.robot.rules import Bat, Rules
from services.jobs.who import operator
from services.robot_io.config import SafetyConfig
from shared.bus.base import Bus, NoAnswer, Pending, Refused
from shared.config.site import load_section
from shared.errors import BusError, ConfigError
from shared.messages.message import Message
from shared.messages.play import BatStates, GateReply, GateRequest, GateState, RefereeState
from shared.messages.topics import ARM, BATS, GATE, REFEREE, Service
from shared.runtime.serve import ServeArgs, open_site_bus
from shared.sim.config import SimConfig

SETTINGS = (
    "play.rest=0.0", "safety.ramp=0.5", "safety.command_hold=0.5",
    "safety.command_trip=1.0", "safety.tracker_hold=0.5", "safety.state_hold=0.5",
    "policy.stale_after=1.0", "policy.referee_silence=2.0", "robot_io.referee_silence=2.0",
    "referee.stale_after=1.0", "referee.void_after=10.0", "game.bout_steps=200",
)  # fmt: skip
"""Patience for a machine that does more than this; and bouts so short that some come to an end
between two faults, for a match gives up after twenty in a row that did not."""
PLAYERS = ("--antagonist", "scripted:slash", "--protagonist", "heuristic")
SHUT = ("disarmed", "tripped")
STILL_SECONDS = 1.0
"""How long a robot that is shut is watched before it is armed."""
STILL_AFTER = 1.5
"""What a robot may take to come to rest once it is shut (s)."""
STILL_WITHIN = 0.01
"""How far its tool may lean meanwhile, for the other robot's bat may push it (m)."""
FENCE_SECONDS = 180.0
"""Longest wait for the robot to fence."""
MOVES = 0.01
"""A robot whose tool went so far in ``SEEN`` states fences (m)."""
SEEN = 30
WATCHER = ("bus.open_seconds=2.0", "bus.give_up_seconds=3600.0")
"""Settings of the watcher's own bus."""
ANSWER_SECONDS = 3.0
ANSWERS_SECONDS = 30.0
"""Longest wait for what is asked again and again."""

R = TypeVar("R", bound=Message)


class Match(Job):
    """A match that goes on until it is stopped."""

    verb = "play"

    def __init__(self, *words: Any, is_recorded: bool = False, **more: Any) -> None:
        """Prepare as any job.

        Args:
            words: of any job.
            is_recorded: whether it has a recorder.
            more: of any job.
        """
        super().__init__(*words, **more)
        self._overrides = (*SETTINGS, f"play.record={str(is_recorded).lower()}")
        self.broken: Counter[str] = Counter()
        """Rules of the gate that were broken, by name."""
        self._bus: Bus | None = None
        self._states: deque[BatStates] = deque(maxlen=200)
        self._mode = ""
        self._phase = ""
        self._rules = Rules(SafetyConfig(), Bat.of(SimConfig()))
        self._asked: Pending[GateReply] | None = None
        self._ask_at = 0.0
        self._is_arming = False

    def _words(self) -> list[str]:
        return [*super()._words(), *PLAYERS]

    @property
    def seconds_left(self) -> float:
        """Return how long it goes on: until it is stopped."""
        return float("inf")

    def poll(self) -> None:
        """Take what is new: logs, states, gate, referee."""
        super().poll()
        if self._bus is None:
            with contextlib.suppress(ConfigError, BusError):  # not there yet, or not now
                place = self.endpoint
                args = ServeArgs(
                    role="chaos", site=None, name="chaos", run=self.folder, run_id=place.run,
                    connect=(place.connect,), overrides=WATCHER,
                )  # fmt: skip
                self._bus = open_site_bus(args, self.clock)
                site = self.folder / "config.toml"
                self._rules = Rules(
                    load_section(site, "safety", SafetyConfig, ()),
                    Bat.of(load_section(site, "sim", SimConfig, ())),
                )
                self._bats = self._bus.subscribe(BATS)
                self._gates = self._bus.subscribe(GATE)
                self._referee = self._bus.subscribe(REFEREE)
            return
        self._bus.wait(0.0)
        self._listen()

    def _listen(self) -> None:
        """Take what has arrived: states, gate, referee."""
        now = self.clock.now()
        while (states := self._bats.take()) is not None:
            self._states.append(states)
            self.timeline.add(now, 1)
        while (gate := self._gates.take()) is not None:
            self._hear(gate)
        while (said := self._referee.take()) is not None:
            self._note(said)

    def _hear(self, gate: GateState) -> None:
        self._mode = gate.mode
        if broken := self._rules.broken_by(gate):
            self.unsafe += 1
            self.broken[broken] += 1
        self.commands = self._rules.checked

    def _rest(self) -> None:
        """Wait as any job does, and meanwhile hear every tick: a gate says only its newest."""
        if self._bus is None:
            super()._rest()
            return
        until = self.clock.now() + POLL_SECONDS
        while (left := until - self.clock.now()) > 0.0:
            self._bus.wait(left)
            self._listen()

    def _note(self, said: RefereeState) -> None:
        self._phase = said.phase

    def travel(self, count: int) -> float:
        """Return how far the tool went in the newest states (m); 0 where there are too few."""
        newest = list(self._states)[-count:]
        if len(newest) < count:
            return 0.0
        tools = np.array([states.tools[1, :3] for states in newest])
        return float(np.ptp(tools, axis=0).max())

    @property
    def is_fencing(self) -> bool:
        """Return whether a bout runs in which the robot moves."""
        is_on = self._phase == "running" and self._mode == "armed"
        return is_on and self.travel(SEEN) > MOVES

    def _is_going(self) -> bool:
        self._be_the_operator()
        return self.is_fencing

    def ready(self) -> None:
        """Wait until it fences, arming where that takes a person.

        Raises:
            JobEnded: the match is over, or does not come to that.
        """
        if not self.until(self._is_going, FENCE_SECONDS):
            raise JobEnded(f"the robot does not fence: {self._mode}, bout {self._phase}")

    def _be_the_operator(self) -> None:
        """Reset and arm, one act at a time, as long as the robot is shut."""
        if self._bus is None or self.clock.now() < self._ask_at:
            return
        if self._asked is None and self._mode in SHUT:
            action = "reset" if self._mode == "tripped" else "arm"
            asked = GateRequest(action=action, operator=operator())
            if action == "arm":
                self._rules.note_arming(may_open=True)
            self._asked = self._bus.ask(ARM, asked, ANSWER_SECONDS)
            self._is_arming = action == "arm"
        elif self._asked is not None and (reply := self._asked.take()) is not None:
            self._asked = None
            self._ask_at = self.clock.now() + 0.3
            if self._is_arming and isinstance(reply, GateReply) and reply.mode in SHUT:
                self._rules.note_arming(may_open=False)

    def shut(self) -> None:
        """Disarm the robot as a person does; the bout is lost by it."""
        asked = GateRequest(action="disarm", operator=operator())
        self.ask_until(ARM, asked, lambda _: self._mode in SHUT)

    def ask_until(
        self, service: Service[Any, R], asked: Message, is_done: Callable[[R], bool], **fields: str
    ) -> R | None:
        """Ask again and again until the answer will do; None where none does in time."""
        pending: Pending[R] | None = None

        def answered() -> R | None:
            nonlocal pending
            if self._bus is None:
                return None
            if pending is None:
                pending = self._bus.ask(service, asked, ANSWER_SECONDS, **fields)
            if (answer := pending.take()) is None:
                return None
            pending = None
            is_answer = not isinstance(answer, NoAnswer | Refused)
            return answer if is_answer and is_done(answer) else None

        return self.until(answered, ANSWERS_SECONDS)

    def after(self, blow: Blow) -> Blow:
        """See that a robot that was shut stays where it is, then have it fence again."""
        if self.broken:
            broken = ", ".join(f"{count} x {what}" for what, count in self.broken.items())
            blow = replace(blow, note=f"{blow.note} BROKEN so far: {broken}".strip())
        if self._mode not in SHUT:
            return replace(blow, note=f"{blow.note} went on, {self._mode}".strip())
        mode = self._mode
        self.rest(STILL_AFTER)
        begin = len(self._states)
        self.rest(STILL_SECONDS)
        moved = self.travel(min(max(len(self._states) - begin, 2), 80))
        if self._mode in SHUT and moved > STILL_WITHIN:
            self.unsafe += 1
        now = self.clock.now()
        self.until(self._is_going, FENCE_SECONDS)
        seconds = self.clock.now() - now
        return replace(
            blow, note=f"{blow.note} {mode}, moved {1e3 * moved:.1f} mm, armed and fencing again "
            f"after {seconds:.1f} s".strip(),
        )  # fmt: skip

    def finish(self) -> int:
        """Stop it as Ctrl-C does; return the exit code, 0 for a match without a last bout."""
        self.poll()
        code = self.interrupt(FINISH_SECONDS)
        self.finished = code == 0 and (self.folder / "summary.json").exists()
        return code

    def close(self) -> None:
        """Leave the bus and no process behind."""
        if self._bus is not None:
            self._bus.close()
        super().close()
