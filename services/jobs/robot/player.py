"""Plays a recording programme: answers robot_io's ticks as a policy does, bout by bout.

It never arms the robot and sends nothing to it: what it publishes is an offset of the tool, which
robot_io puts through the safety gate as any policy's. Each recording is a bout of its own, so that
the referee times it and the recorder archives it. Between recordings robot_io takes the robot back
en garde, at warm-up speed, as between all bouts. Whatever goes wrong ends the programme.
"""

from collections.abc import Callable, Sequence
from typing import Final, Literal

import numpy as np

from services.robot_io.poses import (
    Pose,
    distance,
    length,
    pose_of,
    product,
    rotation_between,
    scale,
)
from services.robot_io.scene import PROTAGONIST
from shared.bus.base import Bus, NoAnswer, Pending, Refused
from shared.clock import Clock
from shared.identification.excitation.reading import AT, PosePlan, Stretch
from shared.messages.message import Array
from shared.messages.play import (
    BatStates,
    DesiredOffset,
    GateMode,
    GateReply,
    GateRequest,
    PlayReply,
    PlayRequest,
    RefereeState,
)
from shared.messages.topics import ARM, BATS, BOUT, GATE, OFFSET, REFEREE

AGENT: Final = "protagonist"
NOBODY: Final = "nobody"
"""Who plays the antagonist, as the archive has it."""
ASK_SECONDS: Final = 2.0
SILENCE_SECONDS: Final = 1.0
"""Longest that robot_io may say nothing."""
HOLD_SECONDS: Final = 1.0
"""Longest that the gate may hold the robot in one recording, all together."""
HOME_SECONDS: Final = 30.0
"""Longest that the way to the start may take."""
HOME_M: Final = 0.05
HOME_RAD: Final = 0.2
"""A robot with friction waits this close to where it is told to."""
STILL: Final = 0.03
"""Slower than this it stands (m/s)."""
TAIL_SECONDS: Final = 0.3
"""The last pose is held for so long before a recording ends."""
TAKE_MOST: Final = 64

Step = Literal["listening", "waiting", "going", "counting", "starting", "playing", "done"]
Say = Callable[[str], None]


class Player:
    """One programme from the first recording to the last; tick it often, it never waits."""

    def __init__(
        self, plan: PosePlan, stretches: Sequence[Stretch], countdown: float, operator: str,
        patience: float, bus: Bus, clock: Clock, say: Say,
    ) -> None:  # fmt: skip
        """Listen; nothing is asked for yet.

        Args:
            plan: what is played.
            stretches: which recordings of it, in order.
            countdown: from the start pose being reached to the motion (s).
            operator: in whose name.
            patience: longest wait for a person to arm the robot (s).
            bus: this process's end of the bus.
            clock: times waits.
            say: tells the person.
        """
        self.plan = plan
        self._left = list(stretches)
        self._count = len(stretches)
        self._countdown = countdown
        self._operator = operator
        self._patience = patience
        self._bus = bus
        self._clock = clock
        self._say = say
        self._bats = bus.subscribe(BATS)
        self._gates = bus.subscribe(GATE)
        self._said = bus.subscribe(REFEREE)
        self._offsets = bus.subscribe(OFFSET, agent=AGENT)
        for role in ("recorder", "referee", "policy"):
            bus.alive(role)  # begins to watch
        now = clock.now()
        self.step: Step = "listening"
        self._since = now
        """When this step began (s)."""
        self._states: BatStates | None = None
        self._heard_at = now
        self._mode: GateMode | None = None
        self._reason = ""
        self._referee: RefereeState | None = None
        self._bout = ""
        self._first_tick: int | None = None
        """Of the recording that is played."""
        self._held = 0.0
        self._held_since: float | None = None
        self._starting: Pending[PlayReply] | None = None
        self._counted = 0
        self.played: list[str] = []
        """Names of the recordings that were played to their end."""
        self.problem = ""
        """Why the programme ended before its last recording."""

    @property
    def is_over(self) -> bool:
        """Return whether nothing is left to do."""
        return self.step == "done" or bool(self.problem)

    @property
    def share(self) -> float:
        """Return how much of the recording that is played now is over (1)."""
        if self.step != "playing" or self._first_tick is None or self._states is None:
            return 0.0
        return min((self._states.tick - self._first_tick) / len(self._left[0].poses), 1.0)

    @property
    def name(self) -> str:
        """Return the recording that is played now or next; empty at the end."""
        return self._left[0].name if self._left else ""

    def tick(self) -> None:
        """Take what was said, answer it, and go on to what comes next."""
        now = self._clock.now()
        self._hear(now)
        if self.is_over:
            return
        if now - self._heard_at > SILENCE_SECONDS and self.step != "listening":
            self._fail(f"robot_io says nothing for {SILENCE_SECONDS:g} s")
        elif self.step in ("going", "counting", "starting", "playing"):
            self._watch(now)
        if not self.problem:
            self._go_on(now)

    def stop(self, reason: str) -> Pending[GateReply]:
        """Abandon a recording that goes on and shut the gate: the robot stays where it is."""
        if self._is_bout_on:
            asked = PlayRequest(action="abandon", bout=self._bout, reason=reason)
            self._bus.ask(BOUT, asked, ASK_SECONDS)
        disarm = GateRequest(action="disarm", operator=self._operator)
        return self._bus.ask(ARM, disarm, ASK_SECONDS)

    def close(self) -> None:
        """Stop listening."""
        for each in (self._bats, self._gates, self._said, self._offsets):
            each.close()

    # -- listening ----------------------------------------------------------------------------

    def _hear(self, now: float) -> None:
        if (gate := self._gates.take()) is not None:
            self._mode, self._reason = gate.mode, gate.reason
        for _ in range(TAKE_MOST):
            if (state := self._said.take()) is None:
                break
            self._referee = state
        for _ in range(TAKE_MOST):
            if (offset := self._offsets.take()) is None:
                break
            if offset.snapshot != self.plan.reference:
                self._fail(
                    f"a policy plays the robot ({offset.snapshot[:24]}): stop it, or start a site "
                    "without one, such as deploy/programme.toml"
                )
        newest: BatStates | None = None
        for _ in range(TAKE_MOST):
            if (states := self._bats.take()) is None:
                break
            newest = states
        if newest is not None:
            self._states, self._heard_at = newest, now
            if self.step != "listening" and not self.problem and newest.is_valid[PROTAGONIST]:
                self._answer(newest)

    def _answer(self, states: BatStates) -> None:
        """Say where the tool should go from where it is."""
        tool = wanted = pose_of(states.tools[PROTAGONIST])
        if self.step in ("counting", "starting", "playing"):
            if self.step == "playing" and states.seconds > 0.0 and self._first_tick is None:
                self._first_tick = states.tick
            gone = 0 if self._first_tick is None else states.tick - self._first_tick
            poses = self._left[0].poses
            wanted = pose_of(poses[min(gone, len(poses) - 1)])
        answer = DesiredOffset(
            agent=AGENT,
            tick=states.tick,
            boot=states.boot,
            snapshot=self.plan.reference,
            offset=offset_between(tool, wanted),
            took_ms=1e3 * (self._clock.now() - self._heard_at),
        )
        self._bus.publish(OFFSET, answer, agent=AGENT)

    @property
    def _is_bout_on(self) -> bool:
        state = self._referee
        is_own = state is not None and bool(self._bout) and state.bout == self._bout
        return is_own and state is not None and state.phase in ("running", "paused")

    # -- one step after the other ---------------------------------------------------------------

    def _go_on(self, now: float) -> None:
        match self.step:
            case "listening":
                self._listen(now)
            case "waiting":
                self._wait(now)
            case "going":
                self._go(now)
            case "counting":
                self._count_down(now)
            case "starting":
                self._start(now)
            case "playing":
                self._play(now)
            case "done":
                pass

    def _to(self, step: Step, now: float) -> None:
        self.step, self._since = step, now

    def _fail(self, problem: str) -> None:
        self.problem = self.problem or problem

    def _watch(self, now: float) -> None:
        """End the programme when the gate has shut, or holds the robot for too long."""
        if self._mode in ("tripped", "disarmed"):
            self._fail(f"the robot is {self._mode}: {self._reason}")
        if self._mode == "holding" and self.step == "playing":
            began = now if self._held_since is None else self._held_since
            self._held_since = began
            if self._held + now - began > HOLD_SECONDS:
                self._fail(f"the gate held the robot for over {HOLD_SECONDS:g} s: {self._reason}")
        elif self._held_since is not None:
            self._held += now - self._held_since
            self._held_since = None

    def _listen(self, now: float) -> None:
        """Look at who is there before anything is said."""
        if now - self._since < SILENCE_SECONDS:
            return
        lacks = [role for role in ("recorder", "referee") if not self._bus.alive(role)]
        if self._states is None or self._mode is None:
            lacks.insert(0, "robot_io")
        if lacks:
            if now - self._since > 10.0 * SILENCE_SECONDS:
                self._fail(f"no {' and no '.join(lacks)} is running: riposte status tells")
            return
        if self._mode not in ("disarmed", "tripped"):
            self._fail(f"the robot is {self._mode} already: riposte robot disarm, then come back")
            return
        self._say("nothing moves yet; with the run stop in hand: riposte robot arm")
        self._to("waiting", now)

    def _wait(self, now: float) -> None:
        if self._mode in ("ramping", "armed"):
            self._say("armed: going to the start")
            self._to("going", now)
        elif now - self._since > self._patience:
            self._fail(f"nobody armed the robot for {self._patience:g} s")

    def _go(self, now: float) -> None:
        states = self._states
        assert states is not None
        tool, start = pose_of(states.tools[PROTAGONIST]), pose_of(self._left[0].poses[0])
        off = distance(tool.position, start.position)
        turn = length(rotation_between(tool.orientation, start.orientation))
        speed = float(np.linalg.norm(states.bats[PROTAGONIST, 7:10]))
        if self._mode == "armed" and off <= HOME_M and turn <= HOME_RAD and speed <= STILL:
            self._counted, self._first_tick = 0, None
            self._to("counting", now)
        elif now - self._since > HOME_SECONDS:
            self._fail(
                f"the tool is {100 * off:.1f} cm and {turn:.2f} rad from the start after "
                f"{HOME_SECONDS:g} s (gate: {self._mode} {self._reason}): what is in its way?"
            )

    def _count_down(self, now: float) -> None:
        if now - self._since >= self._counted < self._countdown:
            self._say(f"{self.name} in {self._countdown - self._counted:g} s")
            self._counted += 1
        if now - self._since < self._countdown:
            return
        stretch = self._left[0]
        stamp = self._clock.wall_ns() // 1_000_000
        self._bout = f"{stretch.name}{AT}{stamp}"
        asked = PlayRequest(
            action="start",
            bout=self._bout,
            antagonist=NOBODY,
            protagonist=self.plan.reference,
            seconds=stretch.seconds + TAIL_SECONDS,
        )
        self._starting = self._bus.ask(BOUT, asked, ASK_SECONDS)
        self._to("starting", now)

    def _start(self, now: float) -> None:
        assert self._starting is not None
        answer = self._starting.take()
        if isinstance(answer, Refused | NoAnswer) or (answer is not None and not answer.accepted):
            self._fail(f"the referee did not start {self.name}: {answer.reason}")
        elif answer is not None:
            self._held, self._held_since = 0.0, None
            self._to("playing", now)

    def _play(self, now: float) -> None:
        state, stretch = self._referee, self._left[0]
        if state is not None and state.bout == self._bout and state.phase == "void":
            self._fail(f"{stretch.name} is void: {state.reason}")
        elif state is not None and state.bout == self._bout and state.phase == "finished":
            self.played.append(stretch.name)
            told = f"{len(self.played)} of {self._count}: {stretch.name}, {stretch.seconds:.1f} s"
            self._say(f"{told}, held for {self._held:.2f} s" if self._held else told)
            self._left.pop(0)
            self._to("going" if self._left else "done", now)
        elif now - self._since > 2.0 * stretch.seconds + 10.0:
            self._fail(f"{stretch.name} does not end: does the referee judge?")


def offset_between(tool: Pose, wanted: Pose) -> Array:
    """Return float64[6], the offset that ``desired_pose`` makes ``wanted`` of ``tool`` with.

    Translation (m) and twice the Gibbs vector of the turn, axis times 2 tan(angle / 2).
    """
    a, b, c, d = tool.orientation
    w, x, y, z = product(wanted.orientation, (a, -b, -c, -d))
    gibbs = scale((x, y, z), 2.0 / w)  # a turn by pi has none; the lead is far smaller
    return np.array([*np.subtract(wanted.position, tool.position), *gibbs])
