"""A match of two policies on the simulated robot, and faults that strike while it fences.

The watcher is the operator: after a trip it waits, sees that nothing moves, and arms again, as a
person would. What it checks of the commands it reads from what robot_io says it sent, against the
numbers of ``[safety]``, with none of the gate's own code.
"""

import contextlib
import signal
from collections import deque
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from services.jobs.chaos.clock import step
from services.jobs.chaos.faults import UP_SECONDS, Blow, Chance, Fault
from services.jobs.chaos.job import FINISH_SECONDS, Job, JobEnded
from services.jobs.chaos.rules import Rules
from services.jobs.chaos.signals import kill, stop
from services.jobs.who import operator
from services.robot_io.config import SafetyConfig
from shared.bus.base import Bus, Pending
from shared.config.site import load_section
from shared.errors import BusError, ConfigError
from shared.messages.play import BatStates, GateReply, GateRequest, GateState, RefereeState
from shared.messages.topics import ARM, BATS, GATE, REFEREE
from shared.runtime.serve import ServeArgs, open_site_bus

SETTINGS = (
    "play.record=false", "play.rest=0.0", "safety.ramp=0.5", "safety.command_hold=0.5",
    "safety.command_trip=1.0", "safety.tracker_hold=0.5", "safety.state_hold=0.5",
    "policy.stale_after=1.0", "policy.referee_silence=2.0", "robot_io.referee_silence=2.0",
    "referee.stale_after=1.0", "referee.void_after=10.0", "game.bout_steps=200",
)  # fmt: skip
"""Patience for a machine that does more than this; and bouts so short that some come to an end
between two faults, for a match gives up after twenty in a row that did not."""
PLAYERS = ("--antagonist", "scripted:slash", "--protagonist", "heuristic")
EVERYBODY = ("router-0", "robot-io-0", "policy-antagonist", "policy-protagonist", "referee-0")
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
JUMP_SECONDS = 3.0
"""How long a clock is wrong."""


class Match(Job):
    """A match that goes on until it is stopped."""

    verb = "play"

    def __init__(self, *words: object, **more: object) -> None:
        """Prepare as any job."""
        super().__init__(*words, **more)  # type: ignore[arg-type]
        self._overrides = SETTINGS
        self._bus: Bus | None = None
        self._states: deque[BatStates] = deque(maxlen=200)
        self._mode = ""
        self._phase = ""
        self._rules = Rules(SafetyConfig())
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
                cfg = load_section(self.folder / "config.toml", "safety", SafetyConfig, ())
                self._rules = Rules(cfg)
                self._bats = self._bus.subscribe(BATS)
                self._gates = self._bus.subscribe(GATE)
                self._referee = self._bus.subscribe(REFEREE)
            return
        self._bus.wait(0.0)
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
        self.unsafe += self._rules.broken_by(gate)
        self.commands = self._rules.checked

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
            if self._is_arming and isinstance(reply, GateReply) and not reply.accepted:
                self._rules.note_arming(may_open=False)

    def after(self, blow: Blow) -> Blow:
        """See that a robot that was shut stays where it is, then have it fence again."""
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


def _kill(name: str) -> Callable[[Match, Chance], Blow]:
    return lambda match, _chance: kill(match, name, signal.SIGKILL)


def _kill_policy(match: Match, chance: Chance) -> Blow:
    return kill(match, chance.one_of(("policy-antagonist", "policy-protagonist")))


def _stop(match: Match, chance: Chance) -> Blow:
    return stop(match, chance.one_of(EVERYBODY), chance.stop_seconds)


def _jump(match: Match, chance: Chance) -> Blow:
    """Step the clock of one process, and back after a while, as its clock service would."""
    name = chance.one_of(EVERYBODY)
    seconds = float(chance.generator.choice((-3600.0, 3600.0)))
    pid = match.until(lambda: match.is_up(name) and match.pid(name), UP_SECONDS)
    at = match.clock.now()
    has_jumped = pid is not None and step(match.clocks, pid, seconds)
    try:
        match.rest(JUMP_SECONDS)
    finally:
        if pid is not None:
            step(match.clocks, pid, -seconds)
    over = match.clock.now()
    return Blow(name, at, over, over if has_jumped else None, f"{seconds:+g} s")


FAULTS: tuple[Fault[Match], ...] = (
    Fault("robot-kill-policy", "kill -9", "one of two policies", _kill_policy),
    Fault("robot-kill-referee", "kill -9", "referee", _kill("referee-0")),
    Fault("robot-kill-robot-io", "kill -9", "robot_io", _kill("robot-io-0")),
    Fault("robot-kill-router", "kill -9", "router of the match", _kill("router-0")),
    Fault(
        "robot-stop", "SIGSTOP for 30 s, then SIGCONT", "any process of the match", _stop,
        seconds=30.0,
    ),
    Fault(
        "robot-clock-jump", f"wall clock an hour off for {JUMP_SECONDS:g} s",
        "any process of the match", _jump, seconds=JUMP_SECONDS,
    ),
)  # fmt: skip
