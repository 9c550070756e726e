"""The safety gate: every command to a robot passes here, and nothing else moves it.

A pure step function over five modes::

    disarmed --arm--> ramping --time--> armed <--> holding
        ^                 |               |           |
        +----reset---- tripped <----------+-----------+        disarm: from anywhere

Only ``arm``, ``disarm`` and ``reset`` are acts of a person. Disarmed and tripped send nothing;
holding brakes along the last command's way, then sends nothing. This is software, not a rated
safety function: the run stop in an operator's hand stays mandatory.
"""

import math
from collections.abc import Iterable
from typing import Final, NamedTuple

import msgspec

from services.robot_io.config import SafetyConfig
from services.robot_io.limits import Blade, Motion, Space, advance
from services.robot_io.poses import Pose, distance, is_pose, unit
from shared.messages.play import GateMode

NEVER: Final = -math.inf
"""An instant before all others."""


class GateInputs(msgspec.Struct, frozen=True, kw_only=True, gc=False):
    """All that the gate looks at in one tick; instants are of one monotonic clock (s)."""

    now: float
    measured: Pose
    """Where the tool is."""
    state_at: float
    """When the robot's state arrived."""
    speed: float
    """Of the tool (m/s)."""
    command: Pose | None
    """Where a policy wants the tool, if it said so since the last tick."""
    is_home: bool = False
    """Whether the command leads back en garde between bouts, at warm-up speed."""
    speed_share: float = 1.0
    """Of the speed in a bout, what this one may have: 0 to 1."""
    tracker_at: float
    """When the person's bat was seen last."""
    is_tracked: bool
    tracker_problem: str = ""
    """Why it is not, where the tracker knows."""
    is_run_stopped: bool = False
    are_motors_halted: bool = False
    generation: int = 0
    """Of the robot's controller: it changes when that is restarted."""
    force: float | None = None
    """On the tool (N); None where the robot does not tell."""
    effort_share: float | None = None
    """Largest share of its limit that a joint gives."""
    problems: tuple[str, ...] = ()
    """What else keeps the robot from being moved, as its link found it."""


class GateMemory(msgspec.Struct, frozen=True, kw_only=True, gc=False):
    """What the gate knows from one tick to the next."""

    mode: GateMode = "disarmed"
    reason: str = "nobody has armed it"
    motion: Motion | None = None
    """The last command; None while disarmed or tripped."""
    goal: Pose | None = None
    """The last usable command asked for."""
    commanded_at: float = NEVER
    """When that was."""
    good_since: float = NEVER
    """Since when nothing has been a reason to hold."""
    armed_at: float = NEVER
    generation: int = 0
    """Of the controller that was armed."""
    rejects: int = 0
    """Unusable commands and states in a row."""
    force_since: float = math.inf
    """Since when the force has been too large."""
    lost_since: float = math.inf
    """Since when the tool has been too far from its command."""
    effort_since: float = math.inf


class GateOutput(msgspec.Struct, frozen=True, kw_only=True, gc=False):
    """What goes to the robot."""

    command: Pose | None
    """None sends nothing."""
    is_clipped: bool = False
    """Whether more was asked for than the limits allow."""


SILENT: Final = GateOutput(command=None)


class Check(NamedTuple):
    """One thing that must be so before a person arms the robot."""

    what: str
    """Empty for a problem of which there is no good side to tell."""
    problem: str
    """Why it is not so; empty when it is."""


class Gate:
    """The gate of one robot; holds no state but its limits."""

    def __init__(self, cfg: SafetyConfig, blade: Blade, period: float) -> None:
        """Take the limits.

        Args:
            cfg: the limits.
            blade: the bat in the tool's frame.
            period: from tick to tick (s).
        """
        self.cfg = cfg
        self._period = period
        self.space = Space(cfg, blade)

    def step(self, memory: GateMemory, inputs: GateInputs) -> tuple[GateMemory, GateOutput]:
        """Return what to remember and what to send; never raises, whatever the inputs are."""
        memory = self._hear(memory, inputs)
        if (motion := memory.motion) is None:
            return memory, SILENT
        memory = self._watch(memory, inputs, motion)
        if reason := self._trips(memory, inputs):
            return tripped(memory, reason), SILENT
        holds = self._holds(memory, inputs)
        good_since = inputs.now if holds or memory.good_since == NEVER else memory.good_since
        mode, reason = self._mode(memory, inputs, holds, good_since)
        measured = inputs.measured if is_pose(inputs.measured) else motion.pose
        goal = None if mode == "holding" else memory.goal
        new = advance(
            motion, goal, measured, self._speed(memory, inputs, mode), self.space, self.cfg,
            self._period,
        )  # fmt: skip
        is_silent = mode == "holding" and motion.is_still
        output = GateOutput(
            command=None if is_silent else new.pose,
            is_clipped=goal is not None and distance(new.pose.position, goal.position) > 1e-6,
        )
        memory = msgspec.structs.replace(
            memory, mode=mode, reason=reason, motion=new, good_since=good_since
        )
        return memory, output

    def arm(
        self, memory: GateMemory, inputs: GateInputs
    ) -> tuple[GateMemory, tuple[str, ...]]:  # fmt: skip
        """Begin to move as a person asks; returns everything that stands in the way."""
        reasons = self.obstacles(memory, inputs)
        if reasons:
            return memory, reasons
        pose = Pose(inputs.measured.position, unit(inputs.measured.orientation))
        armed = GateMemory(
            mode="ramping",
            reason="",
            motion=Motion.at_rest(pose),
            goal=pose,
            commanded_at=memory.commanded_at,
            good_since=inputs.now,
            armed_at=inputs.now,
            generation=inputs.generation,
        )
        return armed, ()

    def reset(
        self, memory: GateMemory, inputs: GateInputs
    ) -> tuple[GateMemory, tuple[str, ...]]:  # fmt: skip
        """Leave ``tripped`` for ``disarmed`` as a person asks, once the robot is in order."""
        if memory.mode != "tripped":
            return memory, (f"the gate is {memory.mode}, there is nothing to reset",)
        if reasons := _problems(self._robot_checks(inputs)):
            return memory, reasons
        return GateMemory(reason="reset after a trip", commanded_at=memory.commanded_at), ()

    def is_astray(self, memory: GateMemory, inputs: GateInputs) -> bool:
        """Return whether a disarmed robot stands where it cannot be armed, whoever asks."""
        is_shut = memory.mode == "disarmed" and is_pose(inputs.measured)
        return is_shut and not self.space.allows(inputs.measured)

    def obstacles(self, memory: GateMemory, inputs: GateInputs) -> tuple[str, ...]:
        """Return everything that stands in the way of arming."""
        return _problems(self.checks(memory, inputs))

    def checks(self, memory: GateMemory, inputs: GateInputs) -> tuple[Check, ...]:
        """Return everything that must be so before arming, and of each why it is not."""
        cfg = self.cfg
        place = ", ".join(f"{number:.2f}" for number in inputs.measured.position)
        checks = (
            Check("the gate is disarmed", _why_not_disarmed(memory)),
            *self._robot_checks(inputs),
            _check(
                f"the policy answers (within {cfg.command_hold:g} s)",
                _is_recent(inputs.now, memory.commanded_at, cfg.command_hold),
                f"no usable command from the policy within {cfg.command_hold:g} s: is it running?",
            ),
            _check(
                f"the other bat is tracked (within {cfg.tracker_hold:g} s)",
                self._is_tracked(inputs),
                _because(
                    f"the other bat was not tracked within {cfg.tracker_hold:g} s",
                    inputs.tracker_problem,
                ),
            ),
            _check(
                f"the robot stands still (at most {cfg.still_speed:g} m/s)",
                inputs.speed <= cfg.still_speed,
                f"the robot moves at {inputs.speed:.3f} m/s, over {cfg.still_speed:g} m/s",
            ),
        )
        if not is_pose(inputs.measured):  # which is a reason already
            return checks
        inside = _check(
            "the tool and its bat are inside their space",
            self.space.allows(inputs.measured),
            f"the tool at ({place}) m, or its bat, is outside its space: move the arm by hand",
        )
        return (*checks, inside)

    def _robot_checks(self, inputs: GateInputs) -> tuple[Check, ...]:
        """Return what must be in order of the robot itself."""
        cfg = self.cfg
        return (
            *(Check("", problem) for problem in inputs.problems),
            _check(
                "the run stop is released", not inputs.is_run_stopped, "the run stop is pressed"
            ),
            _check("the motors are on", not inputs.are_motors_halted, "the motors are halted"),
            _check(
                f"the robot's state is fresh (within {cfg.state_hold:g} s)",
                _is_recent(inputs.now, inputs.state_at, cfg.state_hold),
                f"no state of the robot within {cfg.state_hold:g} s",
            ),
            _check(
                "the tool's measured pose is a pose",
                is_pose(inputs.measured),
                "the tool's measured pose is not a pose",
            ),
        )

    def _hear(self, memory: GateMemory, inputs: GateInputs) -> GateMemory:
        """Take the command if it can be used, and count what cannot."""
        is_sound = is_pose(inputs.measured)
        command = inputs.command
        if command is None:
            rejects = memory.rejects if is_sound else memory.rejects + 1
            return msgspec.structs.replace(memory, rejects=rejects)
        if (
            not is_sound
            or not is_pose(command)
            or distance(command.position, inputs.measured.position) > self.cfg.jump
        ):
            return msgspec.structs.replace(memory, rejects=memory.rejects + 1)
        goal = Pose(command.position, unit(command.orientation))
        return msgspec.structs.replace(memory, goal=goal, commanded_at=inputs.now, rejects=0)

    def _watch(self, memory: GateMemory, inputs: GateInputs, motion: Motion) -> GateMemory:
        """Time what may be exceeded for a moment."""
        cfg = self.cfg
        lead = distance(motion.pose.position, inputs.measured.position)
        return msgspec.structs.replace(
            memory,
            force_since=_since(memory.force_since, inputs.force, cfg.force_trip, inputs.now),
            effort_since=_since(
                memory.effort_since, inputs.effort_share, cfg.effort_trip, inputs.now
            ),
            lost_since=_since(memory.lost_since, lead, cfg.tracking_trip, inputs.now),
        )

    def _trips(self, memory: GateMemory, inputs: GateInputs) -> str:
        """Return why the gate must trip; empty if it need not."""
        cfg, now = self.cfg, inputs.now
        if inputs.is_run_stopped:
            return "the run stop was pressed"
        if inputs.are_motors_halted:
            return "the motors were halted"
        if inputs.generation != memory.generation:
            return "the robot's controller was restarted"
        if inputs.problems:
            return inputs.problems[0]
        if memory.rejects >= cfg.rejects_trip:
            return f"{memory.rejects} unusable commands or states in a row"
        if not _is_recent(now, inputs.state_at, cfg.state_trip):
            return f"no state of the robot for {cfg.state_trip:g} s"
        if not _is_recent(now, memory.commanded_at, cfg.command_trip):
            return f"no usable command for {cfg.command_trip:g} s"
        if now - memory.force_since > cfg.force_seconds:
            return f"over {cfg.force_trip:g} N on the tool for {cfg.force_seconds:g} s"
        if now - memory.lost_since > cfg.tracking_seconds:
            return (
                f"the tool was over {cfg.tracking_trip:g} m from its command "
                f"for {cfg.tracking_seconds:g} s"
            )
        if now - memory.effort_since > cfg.effort_seconds:
            return f"a joint gave over {100 * cfg.effort_trip:.0f} % of its effort limit"
        return ""

    def _holds(self, memory: GateMemory, inputs: GateInputs) -> str:
        """Return why the robot must hold; empty if it need not."""
        cfg, now = self.cfg, inputs.now
        if memory.rejects:
            return "a command or state cannot be used"
        if not _is_recent(now, inputs.state_at, cfg.state_hold):
            return f"no state of the robot for {cfg.state_hold:g} s"
        if not _is_recent(now, memory.commanded_at, cfg.command_hold):
            return f"no command for {cfg.command_hold:g} s"
        if not self._is_tracked(inputs):
            return _because(
                f"the other bat is not tracked for {cfg.tracker_hold:g} s", inputs.tracker_problem
            )
        return ""

    def _is_tracked(self, inputs: GateInputs) -> bool:
        recent = _is_recent(inputs.now, inputs.tracker_at, self.cfg.tracker_hold)
        return inputs.is_tracked and recent

    def _mode(
        self, memory: GateMemory, inputs: GateInputs, holds: str, good_since: float
    ) -> tuple[GateMode, str]:
        if holds:
            return "holding", holds
        if memory.mode == "holding" and inputs.now - good_since < self.cfg.resume_after:
            return "holding", memory.reason
        if inputs.now - memory.armed_at < self.cfg.ramp:
            return "ramping", ""
        return "armed", ""

    def _speed(self, memory: GateMemory, inputs: GateInputs, mode: GateMode) -> float:
        """Return the tool's largest speed now (m/s): minimum-jerk from 0 while ramping."""
        speed = self.cfg.game_speed * inputs.speed_share
        if inputs.is_home:
            speed = self.cfg.warm_up_speed
        if mode != "ramping":
            return speed
        share = min(max((inputs.now - memory.armed_at) / self.cfg.ramp, 0.0), 1.0)
        return speed * share**3 * (10.0 + share * (6.0 * share - 15.0))


def disarmed(memory: GateMemory, reason: str) -> GateMemory:
    """Return the gate shut by a person's will; a trip stays a trip until it is reset."""
    if memory.mode == "tripped":
        return memory
    return GateMemory(reason=reason, commanded_at=memory.commanded_at)


def tripped(memory: GateMemory, reason: str) -> GateMemory:
    """Return the gate shut until a person resets it."""
    return GateMemory(mode="tripped", reason=reason, commanded_at=memory.commanded_at)


def _check(what: str, holds: bool, problem: str) -> Check:
    return Check(what, "" if holds else problem)


def _because(problem: str, cause: str) -> str:
    return f"{problem}: {cause}" if cause else problem


def _problems(checks: Iterable[Check]) -> tuple[str, ...]:
    return tuple(check.problem for check in checks if check.problem)


def _why_not_disarmed(memory: GateMemory) -> str:
    if memory.mode == "tripped":
        return f"the gate has tripped ({memory.reason}): reset it first"
    return "" if memory.mode == "disarmed" else f"the gate is {memory.mode} already"


def _is_recent(now: float, then: float, limit: float) -> bool:
    return now - then <= limit  # False for NaN


def _since(since: float, value: float | None, limit: float, now: float) -> float:
    """Return since when a value has been over its limit; infinity if it is not."""
    if value is None or value <= limit:
        return math.inf
    return min(since, now)
