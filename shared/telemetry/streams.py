"""The streams of a live bout as columns: what is archived and drawn of every message.

A message becomes a row. Every stream has ``t_ns``, the wall clock (ns since 1970) at which its row
held, and those of the 100 Hz loop have ``tick``, which says which rows belong together.
"""

import dataclasses
from collections.abc import Callable, Sequence
from typing import Any, Literal

import msgspec
import numpy as np

from shared.messages.live import ServiceStatus
from shared.messages.message import Array, Message
from shared.messages.play import (
    ArmStates,
    BatStates,
    DesiredOffset,
    GateState,
    HeartRate,
    RefereeState,
    TrackerPose,
)
from shared.messages.robot import RobotReport
from shared.messages.tracking import TrackerRaw
from shared.messages.training import AGENTS

Kind = Literal["float", "int", "bool", "text"]
DTYPES: dict[str, Any] = {
    "float": np.dtype(np.float64),
    "int": np.dtype(np.int64),
    "bool": np.dtype(np.bool_),
    "text": np.dtype(object),
}
LOOP_HZ = 100.0
"""Ticks of robot_io a second."""
TIME = "t_ns"
TICK = "tick"
LINE = "control_step"
"""Of rows that were heard, not of archived ones: the tick on a line through all boots."""
PERSON = "person"
"""Who plays a side that no policy does."""


@dataclasses.dataclass(frozen=True)
class Column:
    """One quantity of a stream."""

    name: str
    unit: str
    """SI; ``1`` for what has none, ``s``-based for time (``ns``, ``ms`` where the name says)."""
    kind: Kind
    about: str
    of: Callable[[Any], Any]
    """What of the message it is."""
    width: int = 0
    """Numbers in a row; 0 for one that is no list."""

    def array(self, messages: Sequence[Message]) -> Array:
        """Return the column of some messages: [T], or [T, width]."""
        values = [self.of(message) for message in messages]
        if self.kind == "text":
            made = np.empty(len(values), object)
            made[:] = values
            return made
        if self.kind == "float" and not self.width:
            values = [np.nan if value is None else value for value in values]
        shape = (len(values), self.width) if self.width else (len(values),)
        return np.array(values, DTYPES[self.kind]).reshape(shape)


@dataclasses.dataclass(frozen=True)
class Stream:
    """A topic as a table."""

    name: str
    about: str
    rate_hz: float
    """Nominal rows a second; 0 where it depends on the source."""
    columns: tuple[Column, ...]
    has_tick: bool = True

    def column(self, name: str) -> Column:
        """Return a column by name.

        Raises:
            KeyError: there is none.
        """
        for column in self.columns:
            if column.name == name:
                return column
        raise KeyError(name)


@dataclasses.dataclass(frozen=True)
class Rows:
    """Some rows of a stream."""

    columns: dict[str, Array]
    """By name, ``t_ns`` first."""

    def __len__(self) -> int:
        """Return how many there are."""
        return len(self.columns[TIME])

    def __getitem__(self, name: str) -> Array:
        """Return a column."""
        return self.columns[name]

    def pick(self, which: "Array | slice") -> "Rows":
        """Return some of the rows."""
        return Rows({name: values[which] for name, values in self.columns.items()})

    @staticmethod
    def join(parts: "Sequence[Rows]") -> "Rows":
        """Return the rows of all parts, in order; there is at least one part."""
        names = parts[0].columns
        return Rows({name: np.concatenate([part[name] for part in parts]) for name in names})


def rows_of(
    stream: Stream, messages: Sequence[Message], t_ns: Sequence[int], bases: Sequence[int] = ()
) -> Rows:
    """Return messages as rows.

    Args:
        stream: whose messages they are.
        messages: in the order they came.
        t_ns: the wall clock of each.
        bases: what is added to the tick of each for its place on the line, where it has one.
    """
    columns: dict[str, Array] = {TIME: np.array(t_ns, np.int64)}
    for column in stream.columns:
        if column.name != TIME:
            columns[column.name] = column.array(messages)
    if stream.has_tick:
        columns[LINE] = columns[TICK] + (np.array(bases, np.int64) if bases else 0)
    return Rows(columns)


def _get(name: str) -> Callable[[Any], Any]:
    return lambda message: getattr(message, name)


def _part(name: str, *index: Any) -> Callable[[Any], Any]:
    return lambda message: getattr(message, name)[index]


def _time(about: str) -> Column:
    return Column(TIME, "ns", "int", about, lambda _: 0)


def _text(name: str, about: str) -> Column:
    return Column(name, "", "text", about, _get(name))


def _flag(name: str, about: str) -> Column:
    return Column(name, "1", "bool", about, _get(name))


def _count(name: str, about: str) -> Column:
    return Column(name, "1", "int", about, _get(name))


def _number(name: str, unit: str, about: str) -> Column:
    return Column(name, unit, "float", about, _get(name))


_TICK = _count(TICK, "of the bat states that it belongs to; counts from 0 in one boot of robot_io")
_AT_TICK = _time("the tick's: when the bat states of that tick were read")
_BOOT = _text("boot", "which run of robot_io; ticks of another one begin anew")


def _pose(prefix: str, field: str, where: str, *side: int) -> tuple[Column, Column]:
    """Return the columns of a pose: the first seven numbers of a field, or of a side of it."""
    return (
        Column(f"{prefix}position", "m", "float", f"x y z {where}".rstrip(),
               _part(field, *side, slice(0, 3)), 3),
        Column(f"{prefix}orientation", "1", "float", f"quaternion w x y z {where}".rstrip(),
               _part(field, *side, slice(3, 7)), 4),
    )  # fmt: skip


def _bat(side: int, agent: str) -> tuple[Column, ...]:
    return (
        *_pose(f"{agent}_", "bats", "of the bat frame, in the world; +x along the blade", side),
        Column(
            f"{agent}_velocity", "m/s", "float", "of the bat frame's origin, in the world",
            _part("bats", side, slice(7, 10)), 3,
        ),
        Column(
            f"{agent}_angular_velocity", "rad/s", "float", "in the world",
            _part("bats", side, slice(10, 13)), 3,
        ),
        Column(
            f"{agent}_is_valid", "1", "bool", "tracked; a state that is not is the last that was",
            _part("is_valid", side),
        ),
        *_pose(f"{agent}_tool_", "tools", "of the tool, as measured, in its torso frame", side),
    )  # fmt: skip


def _arm(side: int, agent: str) -> tuple[Column, ...]:
    return (
        Column(
            f"{agent}_is_there", "1", "bool", "a robot plays this side", _part("is_there", side)
        ),
        Column(
            f"{agent}_joint_positions", "rad", "float", "shoulder to wrist",
            _part("positions", side), 7,
        ),
        Column(
            f"{agent}_joint_velocities", "rad/s", "float", "shoulder to wrist",
            _part("velocities", side), 7,
        ),
    )  # fmt: skip


def _efforts(report: RobotReport) -> Any:
    return report.efforts if len(report.efforts) == 7 else np.full(7, np.nan)


def _json(name: str) -> Callable[[Any], str]:
    return lambda message: msgspec.json.encode(getattr(message, name)).decode()


BATS = Stream(
    "bats", "both bats, and the robots' tools", LOOP_HZ,
    (
        _AT_TICK, _TICK, _BOOT,
        _number("seconds", "s", "game time; 0 outside a bout"),
        _text("tracker_source", "of the newest tracker row in the antagonist's state"),
        _count("tracker_sequence", "of the same row; -1 where there is none"),
        *(column for side, agent in enumerate(AGENTS) for column in _bat(side, agent)),
    ),
)  # fmt: skip
ARMS = Stream(
    "arms", "joints of the robots that play", LOOP_HZ,
    (
        _AT_TICK, _TICK,
        *(column for side, agent in enumerate(AGENTS) for column in _arm(side, agent)),
    ),
)  # fmt: skip
ROBOT = Stream(
    "robot", "what the protagonist's robot says of itself", LOOP_HZ,
    (
        _time("when this state of the robot arrived"), _TICK,
        _number("speed", "m/s", "of the tool"),
        _number("force", "N", "on the tool; NaN where the robot does not tell"),
        _number("effort_share", "1", "largest share of its limit that a joint gives; or NaN"),
        Column("efforts", "N m", "float", "of the joints, shoulder to wrist; or NaN", _efforts, 7),
        _flag("is_run_stopped", "the run stop is pressed"),
        _flag("are_motors_halted", "the motors are off"),
        _count("generation", "changes when the robot's controller is restarted"),
        Column("problems", "", "text", "what keeps it from being moved, JSON list",
               _json("problems")),
    ),
)  # fmt: skip
GATE = Stream(
    "gate", "what the safety gate did, and what it sent", LOOP_HZ,
    (
        _AT_TICK, _TICK,
        _text("mode", "disarmed, ramping, armed, holding or tripped"),
        _text("reason", "why it holds or has tripped"),
        *_pose("commanded_", "commanded", "of the tool's last command, torso frame"),
        _flag("is_sent", "a command went to the robot in this tick"),
        _flag("is_clipped", "more was asked for than the limits allow"),
        _number("lateness_ms", "ms", "of this tick of the loop"),
        _number("answer_ms", "ms", "tick's states read to a policy's command sent; NaN if none"),
        _count("late_ticks", "ticks over one period late, since robot_io started"),
    ),
)  # fmt: skip
REFEREE = Stream(
    "referee", "phase, score and tone, after every step judged", LOOP_HZ,
    (
        _AT_TICK, _TICK,
        _text("bout", "its name"),
        _text("phase", "ready, running, paused, finished or void"),
        _text("reason", "why it is paused or void"),
        _count("step", "steps judged"),
        _number("seconds", "s", "game time"),
        _number("score", "1", "the antagonist's points so far"),
        _number("points", "1", "of the last step"),
        *(
            Column(f"{agent}_in_target", "1", "bool", "its bat is in the target",
                   _part("in_target", side))
            for side, agent in enumerate(AGENTS)
        ),
        _flag("contact", "the bats touch"),
        _count("attack_steps", "steps that paid a point"),
        _count("penalty_steps", "steps that cost ten"),
        _count("camping_steps", "steps that paid ten because the protagonist camped"),
        _count("missed_ticks", "ticks that never arrived, judged as the one before"),
        _number("tone_hz", "Hz", "440 while scoring, 300 on a penalty, 0 for silence"),
    ),
)  # fmt: skip


def _offsets(agent: str) -> Stream:
    return Stream(
        f"{agent}_offsets", f"what the {agent}'s policy wants, one answer a tick", LOOP_HZ,
        (
            _AT_TICK, _TICK,
            _text("snapshot", "player reference"),
            Column("translation", "m", "float", "bounded offset of the tool",
                   _part("offset", slice(0, 3)), 3),
            Column("rotation", "rad", "float", "axis times 2 tan(angle / 2)",
                   _part("offset", slice(3, 6)), 3),
            _number("took_ms", "ms", "from the arrival of the bat states to this answer"),
        ),
    )  # fmt: skip


OFFSETS = {agent: _offsets(agent) for agent in AGENTS}
TRACKER = Stream(
    "tracker", "a person's bat as its source sent it, before robot_io's filter", 0.0,
    (
        _time("when the recorder got it (to 20 ms)"),
        _count("sequence", "counts the poses of one source from 0"),
        _text("source", "which page or program"),
        *_pose("", "pose", "in the world"),
        _flag("is_valid", "the source sees the bat"),
    ),
    has_tick=False,
)  # fmt: skip
TRACKER_RAW = Stream(
    "tracker_raw", "a Vive tracker in the base stations' frame, before calibration", 0.0,
    (
        _time("when the tracker said it"),
        _text("serial", "of the tracker"),
        *_pose("", "pose", ""),
        _flag("is_valid", "the base stations see it"),
    ),
    has_tick=False,
)  # fmt: skip
HEART_RATE = Stream(
    "heart_rate", "of the person who plays", 1.0,
    (
        _time("of the measurement"),
        _number("beats_per_minute", "1/min", "as the strap says"),
        Column("rr_ms", "", "text", "intervals between beats (ms), JSON list", _json("rr_ms")),
        _flag("contact", "the strap touches skin"),
        _text("source", "which strap or file"),
    ),
    has_tick=False,
)  # fmt: skip
SERVICES = Stream(
    "services", "health of every process, each once a second", 0.0,
    (
        _time("when the recorder got it (to 20 ms)"),
        _text("role", "robot-io, policy, ..."), _text("name", "of the process"),
        _text("boot", "which run of it"), _text("state", "what it does"),
        _text("waiting_for", "whom it waits for"), _text("last_error", "the latest"),
        _number("cpu_seconds", "s", "used since its start"),
        _count("rss_bytes", "memory, resident"),
        Column("rates", "", "text", "by name with unit, JSON; lateness percentiles among them",
               _json("rates")),
        Column("counters", "", "text", "since its start, JSON", _json("counters")),
    ),
    has_tick=False,
)  # fmt: skip

STREAMS: tuple[Stream, ...] = (
    BATS, ARMS, ROBOT, GATE, REFEREE, *OFFSETS.values(), TRACKER, TRACKER_RAW,
    HEART_RATE, SERVICES,
)  # fmt: skip
BY_NAME = {stream.name: stream for stream in STREAMS}
MESSAGES: dict[str, type[Message]] = {
    BATS.name: BatStates,
    ARMS.name: ArmStates,
    ROBOT.name: RobotReport,
    GATE.name: GateState,
    REFEREE.name: RefereeState,
    **{stream.name: DesiredOffset for stream in OFFSETS.values()},
    TRACKER.name: TrackerPose,
    TRACKER_RAW.name: TrackerRaw,
    HEART_RATE.name: HeartRate,
    SERVICES.name: ServiceStatus,
}
"""What the rows of each stream are made of."""
