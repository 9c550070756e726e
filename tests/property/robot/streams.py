"""Random streams of commands for a gate, each checked command by command.

A stream is half a second of one robot: a tool somewhere in its space, a tempo of following, some
limits, and somebody who sends. It begins disarmed, or armed at rest with its ramp behind it, so
that full speed is reached within it.
"""

import math
import random
from collections.abc import Callable
from dataclasses import dataclass, field

import msgspec

from services.robot_io.config import SafetyConfig
from services.robot_io.gate import Gate, GateInputs, GateMemory, disarmed
from services.robot_io.limits import Blade
from services.robot_io.poses import Pose, Vector, add, distance, length, rotation_between, turned

PERIOD = 0.01
STEPS = 40
SMALL = 1e-6
BLADE = Blade(direction=(0.70710678, 0.0, 0.70710678), front=0.7, back=-0.05, radius=0.025)
BAD = (math.nan, math.inf, -math.inf, 1e300, -1e300, 0.0, 3.0)
LIMITS = {
    "game_speed": (0.25, 1.0), "acceleration": (1.0, 20.0), "turn_speed": (0.2, 4.0),
    "turn_acceleration": (1.0, 60.0), "lead": (0.03, 0.15), "ceiling": (0.7, 0.9),
    "keep_out_radius": (0.1, 0.6), "ramp": (0.5, 2.0),
}  # fmt: skip
"""Smallest and largest value of each limit that is tried."""
Sender = Callable[[int, Pose], Pose | None]


@dataclass
class Tally:
    """What came out of many streams."""

    streams: int = 0
    steps: int = 0
    commands: int = 0
    fastest: float = 0.0
    """As a share of the limit; so are the next ones."""
    hardest: float = 0.0
    furthest: float = 0.0
    modes: dict[str, int] = field(default_factory=dict)
    kinds: dict[str, int] = field(default_factory=dict)


def random_limits(draw: random.Random) -> SafetyConfig:
    return SafetyConfig(**{name: draw.uniform(*limits) for name, limits in LIMITS.items()})


def random_pose(draw: random.Random, gate: Gate) -> Pose:
    """Somewhere in the space, often at its edge."""
    low, high = gate.cfg.box_low, gate.cfg.box_high
    while True:
        x, y, z = (
            draw.choice((a, b)) if draw.random() < 0.2 else draw.uniform(a, b)
            for a, b in zip(low, high, strict=True)
        )
        pose = Pose((x, y, z), random_turn(draw))
        if gate.space.allows(pose):
            return pose


def random_turn(draw: random.Random) -> tuple[float, float, float, float]:
    four = [draw.gauss(0.0, 1.0) for _ in range(4)]
    size = math.hypot(*four)
    return four[0] / size, four[1] / size, four[2] / size, four[3] / size


def vector(draw: random.Random, size: float) -> Vector:
    return tuple(draw.uniform(-size, size) for _ in range(3))  # type: ignore[return-value]


def offset(draw: random.Random, size: float) -> Sender:
    """Always as far ahead of the tool: what a policy does."""
    way, turn = vector(draw, size), vector(draw, 8.0 * size)
    return lambda step, tool: Pose(add(tool.position, way), turned(tool.orientation, turn))


def to_and_fro(draw: random.Random, size: float) -> Sender:
    """As far as it may, the other way every few steps."""
    way, turn, every = vector(draw, size), vector(draw, 8.0 * size), draw.randint(1, 12)

    def send(step: int, tool: Pose) -> Pose:
        sign = 1.0 if step // every % 2 else -1.0
        turns = turned(tool.orientation, (sign * turn[0], sign * turn[1], sign * turn[2]))
        return Pose(add(tool.position, way, sign), turns)

    return send


def fixed(draw: random.Random, size: float) -> Sender:
    """One place in space, reachable or not."""
    place = vector(draw, 10.0 * size)
    turn = random_turn(draw)
    start: list[Pose] = []

    def send(step: int, tool: Pose) -> Pose:
        start.append(tool) if not start else None
        return Pose(add(start[0].position, place), turn)

    return send


def noise(draw: random.Random, size: float) -> Sender:
    """Another place each time, some of them too far to be believed."""

    def send(step: int, tool: Pose) -> Pose:
        far = size if draw.random() < 0.9 else 4.0
        turns = turned(tool.orientation, vector(draw, 3.0))
        return Pose(add(tool.position, vector(draw, far)), turns)

    return send


def broken(draw: random.Random, size: float) -> Sender:
    """An offset in which numbers are none, or not of this world."""
    sound, share = offset(draw, size), draw.choice((0.02, 0.2, 1.0))

    def send(step: int, tool: Pose) -> Pose:
        pose = sound(step, tool)
        assert pose is not None
        if draw.random() >= share:
            return pose
        numbers = [*pose.position, *pose.orientation]
        for _ in range(draw.randint(1, 7)):
            numbers[draw.randrange(7)] = draw.choice(BAD)
        return Pose(tuple(numbers[:3]), tuple(numbers[3:]))  # type: ignore[arg-type]

    return send


def halting(draw: random.Random, size: float) -> Sender:
    """An offset that falls silent for a while, or for good."""
    sound, begin = offset(draw, size), draw.randrange(STEPS)
    end = begin + draw.choice((3, 12, 30, STEPS))
    return lambda step, tool: None if begin <= step < end else sound(step, tool)


KINDS: dict[str, Callable[[random.Random, float], Sender]] = {
    "offset": offset, "to_and_fro": to_and_fro, "fixed": fixed, "noise": noise,
    "broken": broken, "halting": halting,
}  # fmt: skip


def trouble(draw: random.Random, inputs: GateInputs) -> GateInputs:
    """Something around the command that is not as it should be."""
    now, age = inputs.now, draw.choice((0.03, 0.07, 0.2, math.inf, math.nan))
    changed: dict[str, object] = draw.choice(
        (
            {"state_at": now - age}, {"tracker_at": now - age}, {"is_tracked": False},
            {"is_run_stopped": True}, {"are_motors_halted": True}, {"generation": 1},
            {"force": draw.choice((80.0, math.nan))},
            {"effort_share": draw.choice((2.0, math.nan))},
            {"problems": ("a fault",)}, {"speed": math.nan},
            {"now": draw.choice((now - 1.0, now + 1.0))},
            {"measured": Pose((math.nan, 0.0, 0.0), inputs.measured.orientation)},
        )
    )  # fmt: skip
    return msgspec.structs.replace(inputs, **changed)


def play(draw: random.Random, gate: Gate, tally: Tally) -> None:
    """Send one stream through a gate and hold every command against the limits."""
    kind = draw.choice(tuple(KINDS))
    send = KINDS[kind](draw, draw.choice((0.01, 0.05, 0.15)))
    follows = draw.choice((0.0, 0.07, 0.5, 1.0))
    troubled = draw.choice((0.0, 0.0, 0.01, 0.1))
    tool = random_pose(draw, gate)
    now = draw.uniform(0.0, 1e6)
    memory = GateMemory(commanded_at=now)
    is_armed = draw.random() < 0.9
    if is_armed:
        memory, reasons = gate.arm(memory, inputs_of(now, tool, None))
        assert not reasons
        if draw.random() < 0.9:  # at rest, its ramp behind it
            memory = msgspec.structs.replace(memory, armed_at=now - gate.cfg.ramp)
    watch = Watch(gate, tool, tally)
    for step in range(STEPS):
        now += PERIOD
        inputs = inputs_of(now, tool, send(step, tool))
        if draw.random() < troubled:
            inputs = trouble(draw, inputs)
        if is_armed and draw.random() < 0.002:
            memory, is_armed = disarmed(memory, "asked"), False
        memory, output = gate.step(memory, inputs)
        tally.modes[memory.mode] = tally.modes.get(memory.mode, 0) + 1
        is_armed = is_armed and memory.mode not in ("disarmed", "tripped")
        if not is_armed:
            assert output.command is None, memory.mode
            assert memory.mode in ("disarmed", "tripped")
        elif output.command is None:
            assert memory.mode == "holding"
            assert watch.is_still
        else:
            watch.check(output.command, tool, is_following=follows < 1.0)
        if watch.last is not None:
            way = add(watch.last.position, tool.position, -1.0)
            tool = Pose(add(tool.position, way, follows), watch.last.orientation)
    tally.streams += 1
    tally.steps += STEPS
    tally.kinds[kind] = tally.kinds.get(kind, 0) + 1


def inputs_of(now: float, tool: Pose, command: Pose | None) -> GateInputs:
    return GateInputs(
        now=now, measured=tool, state_at=now, speed=0.0, command=command, tracker_at=now,
        is_tracked=True,
    )  # fmt: skip


class Watch:
    """Holds each command of a stream against the one before it and against the limits."""

    def __init__(self, gate: Gate, start: Pose, tally: Tally) -> None:
        self._gate = gate
        self._tally = tally
        self.last: Pose = start
        self._velocity: Vector = (0.0, 0.0, 0.0)
        self._spin: Vector = (0.0, 0.0, 0.0)

    @property
    def is_still(self) -> bool:
        return length(self._velocity) <= SMALL and length(self._spin) <= SMALL

    def check(self, command: Pose, tool: Pose, *, is_following: bool) -> None:
        cfg, tally = self._gate.cfg, self._tally
        assert all(map(math.isfinite, (*command.position, *command.orientation)))
        assert abs(math.hypot(*command.orientation) - 1.0) < SMALL
        for low, value, high in zip(cfg.box_low, command.position, cfg.box_high, strict=True):
            assert low - SMALL <= value <= high + SMALL
        assert self._gate.space.clearance(command) >= -SMALL  # the bat: ceiling and person too
        moved = add(command.position, self.last.position, -1.0)
        velocity = (moved[0] / PERIOD, moved[1] / PERIOD, moved[2] / PERIOD)
        turn = rotation_between(self.last.orientation, command.orientation)
        spin = (turn[0] / PERIOD, turn[1] / PERIOD, turn[2] / PERIOD)
        speed, change = length(velocity), distance(velocity, self._velocity)
        assert speed <= cfg.game_speed + SMALL
        assert change <= cfg.acceleration * PERIOD + SMALL
        assert length(spin) <= cfg.turn_speed + SMALL
        assert distance(spin, self._spin) <= cfg.turn_acceleration * PERIOD + SMALL
        if is_following:  # a tool that stays or follows is never led further
            far = distance(command.position, tool.position)
            assert far <= cfg.lead + SMALL
            tally.furthest = max(tally.furthest, far / cfg.lead)
        tally.commands += 1
        tally.fastest = max(tally.fastest, speed / cfg.game_speed)
        tally.hardest = max(tally.hardest, change / (cfg.acceleration * PERIOD))
        self.last, self._velocity, self._spin = command, velocity, spin
