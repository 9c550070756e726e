"""The 100 Hz loop: read, check, limit, write, publish; every command passes the gate."""

from collections import OrderedDict
from collections.abc import Callable

import msgspec
import numpy as np
import structlog

from services.robot_io.config import RobotIoConfig
from services.robot_io.course import Course, way_home
from services.robot_io.extras import Extras
from services.robot_io.gate import Gate, GateInputs, GateMemory, GateOutput, disarmed
from services.robot_io.links import Floats, OtherRobot, PersonBat, RobotLink, RobotState
from services.robot_io.poses import Pose, array_of, is_pose, pose_of
from services.robot_io.reporting import report_of
from services.robot_io.trackers import Tracker
from shared.bus.base import Bus, Subscription
from shared.clock import Clock
from shared.messages.play import (
    ArmStates,
    BatStates,
    DesiredOffset,
    GateReply,
    GateRequest,
    GateState,
)
from shared.messages.topics import ARM, ARMS, BATS, GATE, OFFSET, ROBOT
from shared.policy.action import desired_pose
from shared.runtime.durations import EXTREME, Durations
from shared.runtime.service import Health

ANTAGONIST, PROTAGONIST = 0, 1
REMEMBERED_TICKS = 64
"""An answer to an older tick is not used."""
TAKE_MOST = 64
"""Messages of one kind taken at a time, so that a flood cannot hold up the loop."""
KEPT = 6000
"""Ticks whose lateness is looked back on: a minute at 100 Hz."""

log = structlog.get_logger()


class Parts(msgspec.Struct, frozen=True, kw_only=True):
    """What stands around the loop."""

    gate: Gate
    link: RobotLink
    tracker: Tracker
    home: Pose
    """En garde, where the robot goes between bouts."""
    other_home: Pose | None = None
    """The same of the robot opposite."""
    other: OtherRobot | None = None
    """The robot opposite, if a policy plays there."""
    person: PersonBat | None = None
    """The scene that a person's bat is put into."""
    put_back: Callable[[], None] | None = None
    """Puts a simulated robot's arm en garde, as people do a real one by hand: after a reset, and
    where it cannot be armed as it stands."""
    extras: Extras = Extras()
    """What runs beside the loop."""


class RobotIo:
    """One robot and the bat opposite; a service that ticks, at the latest at ``due_at``."""

    def __init__(
        self, cfg: RobotIoConfig, parts: Parts, period: float, bus: Bus, clock: Clock
    ) -> None:
        """Join the bus, disarmed.

        Args:
            cfg: settings of the loop.
            parts: what stands around it.
            period: from tick to tick (s).
            bus: this process's end of the bus.
            clock: a clock that moves by itself, or is moved.
        """
        self._cfg = cfg
        self._parts = parts
        self._period = period
        self._bus = bus
        self._clock = clock
        self._offsets: Subscription[DesiredOffset] = bus.subscribe(OFFSET)
        self._people = bus.answer(ARM)
        self._course = Course(bus, cfg.referee_silence, period)
        self._memory = GateMemory()
        now = clock.now()
        self._start = now
        self._tick = -1
        self._tools: OrderedDict[int, Floats] = OrderedDict()
        self._answered = [-1, -1]
        self._command: Pose | None = None
        self._is_open = False
        """Whether this tick's command has not gone out yet."""
        self._began_at = now
        self._read_at = now
        self._read_ns = 0
        """The same, of the wall's clock."""
        self._is_sound = False
        """Whether this tick's state of the robot is made of numbers."""
        self._lateness_ms = 0.0
        self._answer_ms: float | None = None
        self._answered_tick: int | None = None
        self._robot = parts.link.read(now)
        self._bat = self._robot.bat
        self._tracked = parts.tracker.read(now)
        self._commanded = self._robot.tool
        self._lateness = Durations("lateness_{}_ms", KEPT, EXTREME)
        self._answer = Durations("command_{}_ms", KEPT, EXTREME)
        self._counters = {
            "ticks": 0,
            "ticks_late": 0,
            "ticks_lost": 0,
            "commands_sent": 0,
            "commands_clipped": 0,
            "commands_repeated": 0,
            "offsets_stale": 0,
            "trips": 0,
        }

    @property
    def due_at(self) -> float:
        """Return when the loop must be ticked again, whatever arrives (s)."""
        if self._is_open:
            return min(self._began_at + self._cfg.answer_wait, self._next_at)
        return self._next_at

    @property
    def _next_at(self) -> float:
        return self._start + (self._tick + 1) * self._period

    def tick(self) -> bool:
        """Do what is due; return whether anything was done."""
        did = self._course.hear(self._clock.now())
        did = self._hear_offsets() or did
        now = self._clock.now()
        if self._is_open and (self._command is not None or now >= self.due_at):
            self._send(now)
            did = True
        if now >= self._next_at:
            self._begin(now)
            did = True
        for _ in range(TAKE_MOST):
            if (request := self._people.take()) is None:
                break
            request.reply(self._ask_gate(request.message))
            did = True
        self._parts.extras.tick(now)
        return did

    def _begin(self, now: float) -> None:
        """Read, and say where both bats are."""
        due = self._next_at
        lost = int((now - due) / self._period)
        self._tick += 1 + lost
        self._began_at = now
        self._lateness_ms = 1e3 * (now - due)
        self._lateness.add(self._lateness_ms)
        self._counters["ticks"] += 1
        self._counters["ticks_lost"] += lost
        self._counters["ticks_late"] += now - due > self._period
        self._robot = self._parts.link.read(now)
        tracked = self._parts.tracker.read(now)
        if not np.isfinite(tracked.state).all():
            tracked = msgspec.structs.replace(self._tracked, is_valid=False)
        self._tracked = tracked
        if self._parts.person is not None and self._tracked.is_valid:
            self._parts.person.place_person(self._tracked.state)
        self._read_at, self._read_ns = self._clock.now(), self._clock.wall_ns()
        self._publish_states(now)
        self._is_open = True

    def _publish_states(self, now: float) -> None:
        robot, tracked = self._robot, self._tracked
        both = self._both_tools(robot)
        self._is_sound = bool(np.isfinite(robot.bat).all() and np.isfinite(both).all())
        if self._is_sound:
            self._bat = robot.bat
            self._tools[self._tick] = both
            if len(self._tools) > REMEMBERED_TICKS:
                self._tools.popitem(last=False)
        hold = self._parts.gate.cfg.state_hold
        is_valid = [tracked.is_valid, self._is_sound and now - robot.at <= hold]
        tools = self._tools.get(self._tick, np.zeros((2, 7)))
        self._bus.publish(
            BATS,
            BatStates(
                tick=self._tick,
                boot=self._bus.boot,
                at_ns=self._read_ns,
                bats=np.array([tracked.state, self._bat]),
                tools=tools,
                is_valid=np.array(is_valid),
                seconds=self._course.seconds(self._tick, now),
                tracker_source=tracked.source,
                tracker_sequence=tracked.sequence,
            ),
        )

    def _publish_robot(self) -> None:
        """Say what nobody answers, once the command is out."""
        robot = self._robot
        if self._is_sound:
            self._publish_arms(robot)
        report = report_of(robot, self._tick, self._bus.boot, self._read_at, self._read_ns)
        self._bus.publish(ROBOT, report)

    def _both_tools(self, robot: RobotState) -> Floats:
        tools = np.zeros((2, 7))
        tools[PROTAGONIST] = robot.tool
        if self._parts.other is not None:
            tools[ANTAGONIST] = self._parts.other.read_other()[1]
        return tools

    def _publish_arms(self, robot: RobotState) -> None:
        positions, velocities = np.zeros((2, 2, 7))
        positions[PROTAGONIST] = robot.joints
        velocities[PROTAGONIST] = robot.joint_velocities
        other = self._parts.other
        if other is not None:
            _, _, positions[ANTAGONIST], velocities[ANTAGONIST] = other.read_other()
        arms = ArmStates(
            tick=self._tick,
            boot=self._bus.boot,
            is_there=np.array([other is not None, True]),
            positions=positions,
            velocities=velocities,
        )
        self._bus.publish(ARMS, arms)

    def _hear_offsets(self) -> bool:
        did = False
        for _ in range(TAKE_MOST):
            if (offset := self._offsets.take()) is None:
                break
            did = True
            side = PROTAGONIST if offset.agent == "protagonist" else ANTAGONIST
            tools = self._tools.get(offset.tick) if offset.boot == self._bus.boot else None
            if tools is None or offset.tick <= self._answered[side]:
                self._counters["offsets_stale"] += 1
                continue
            self._answered[side] = offset.tick
            pose = desired_pose(offset.offset[:, None], tools[side][:, None])[:, 0]
            if side == PROTAGONIST:
                self._command = pose_of(pose)
            elif self._parts.other is not None:
                self._move_other(pose)
        return did

    def _move_other(self, pose: Floats) -> None:
        """Command the simulated robot opposite, which no gate guards, for it is nobody's."""
        other = self._parts.other
        assert other is not None
        if self._goes_home and self._parts.other_home is not None:
            tool = other.read_other()[1]
            pose = array_of(way_home(self._parts.other_home, pose_of(tool)))
        if is_pose(pose_of(pose)):
            other.write_other(pose)

    @property
    def _goes_home(self) -> bool:
        return self._cfg.return_home and self._course.is_between

    def _send(self, now: float) -> None:
        """Check, limit and write the command of this tick, and say what was done."""
        self._is_open = False
        command, self._command = self._command, None
        is_home = command is not None and self._goes_home
        if is_home:
            command = way_home(self._parts.home, pose_of(self._robot.tool))
        inputs = self._inputs(now, command, is_home=is_home)
        self._counters["commands_repeated"] += command is None
        before = self._memory
        self._memory, output = self._parts.gate.step(before, inputs)
        self._answer_ms = self._answered_tick = None
        if output.command is not None:
            self._commanded = array_of(output.command)
            self._parts.link.write(self._commanded)
            self._counters["commands_sent"] += 1
            if command is not None:
                self._answer_ms = 1e3 * (self._clock.now() - self._read_at)
                self._answered_tick = self._answered[PROTAGONIST]
                self._answer.add(self._answer_ms)
        self._counters["commands_clipped"] += output.is_clipped
        self._note(before)
        self._publish_gate(output)
        self._publish_robot()

    def _publish_gate(self, output: GateOutput) -> None:
        state = GateState(
            tick=self._tick,
            mode=self._memory.mode,
            reason=self._memory.reason,
            commanded=self._commanded,
            is_clipped=output.is_clipped,
            is_sent=output.command is not None,
            lateness_ms=self._lateness_ms,
            answer_ms=self._answer_ms,
            answered_tick=self._answered_tick,
            late_ticks=self._counters["ticks_late"],
        )
        self._bus.publish(GATE, state)

    def _inputs(self, now: float, command: Pose | None, *, is_home: bool = False) -> GateInputs:
        robot, tracked = self._robot, self._tracked
        return GateInputs(
            now=now,
            measured=pose_of(robot.tool),
            state_at=robot.at,
            speed=robot.speed,
            command=command,
            is_home=is_home,
            speed_share=self._course.speed,
            tracker_at=tracked.seen_at,
            is_tracked=tracked.is_valid,
            tracker_problem=tracked.problem,
            is_run_stopped=robot.is_run_stopped,
            are_motors_halted=robot.are_motors_halted,
            generation=robot.generation,
            force=robot.force,
            effort_share=robot.effort_share,
            problems=robot.problems,
        )

    def _ask_gate(self, asked: GateRequest) -> GateReply:
        """Do what a person asks of the gate."""
        before = self._memory
        inputs = self._inputs(self._clock.now(), None)
        if asked.action == "check":
            return self._check_gate(inputs)
        reasons: tuple[str, ...] = ()
        if asked.action == "arm":
            self._memory, reasons = self._parts.gate.arm(before, inputs)
            if self._parts.put_back is not None and self._parts.gate.is_astray(before, inputs):
                self._parts.put_back()
                reasons = ("the simulated arm stood outside its space and is en garde: arm again",)
        elif asked.action == "reset":
            self._memory, reasons = self._parts.gate.reset(before, inputs)
            if not reasons and self._parts.put_back is not None:
                self._parts.put_back()
        else:
            self._memory = disarmed(before, f"disarmed by {asked.operator}")
        log.info(
            "gate_asked",
            action=asked.action,
            operator=asked.operator,
            mode=self._memory.mode,
            reasons=list(reasons),
        )
        self._note(before)
        return GateReply(accepted=not reasons, mode=self._memory.mode, reasons=reasons)

    def _check_gate(self, inputs: GateInputs) -> GateReply:
        """Say what must be so before arming; changes nothing."""
        checks = self._parts.gate.checks(self._memory, inputs)
        reasons = tuple(check.problem for check in checks if check.problem)
        passed = tuple(check.what for check in checks if not check.problem)
        return GateReply(
            accepted=not reasons,
            mode=self._memory.mode,
            reasons=reasons,
            passed=(*self._robot.passed, *self._tracked.passed, *passed),
        )

    def _note(self, before: GateMemory) -> None:
        """Log a change of mode; a gate that shuts lets the robot stay where it is."""
        after = self._memory
        if after.mode == before.mode:
            return
        self._counters["trips"] += after.mode == "tripped"
        log.info("gate_changed", before=before.mode, mode=after.mode, reason=after.reason)
        if after.motion is None and before.motion is not None:
            self._parts.link.hold()

    def health(self) -> Health:
        """Return the gate's mode, and how late the loop was."""
        waits = self._memory.mode == "holding"
        extras, tracker = self._parts.extras, self._parts.tracker
        problem = self._tracked.problem or extras.problem
        return Health(
            state=f"{self._memory.mode}: {self._memory.reason}".rstrip(": "),
            waiting_for=self._memory.reason if waits else "",
            rates={
                **self._lateness.percentiles(),
                **self._answer.percentiles(),
                **self._parts.link.rates(),
                **tracker.rates(),
                **extras.rates(),
            },
            counters={
                **self._counters,
                **self._parts.link.counters(),
                **tracker.counters(),
                **extras.counters(),
            },
            last_error=self._memory.reason if self._memory.mode == "tripped" else problem,
        )

    def close(self) -> None:
        """Make the robot stay where it is, whatever has happened, and let go of it."""
        self._parts.link.hold()
        self._parts.link.close()
        self._parts.tracker.close()
        self._offsets.close()
        self._people.close()
        self._course.close()
        self._parts.extras.close()
