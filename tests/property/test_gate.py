"""The gate under 100,000 random steps: whatever comes in, what goes out is within the limits."""

import math
import random

import msgspec
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from services.robot_io.config import SafetyConfig
from services.robot_io.gate import Gate, GateInputs, GateMemory, disarmed
from services.robot_io.poses import Pose, add, distance, length, rotation_between, turned, unit
from tests.property.robot.streams import BLADE, LIMITS, PERIOD, SMALL

EXAMPLES = 200
STEPS = 500
START = Pose((0.553, -0.25, 0.0), (0.67, 0.324, -0.085, 0.663))

RANGES = LIMITS | {"ramp": (0.5, 1.0)}

limits = st.builds(SafetyConfig, **{name: st.floats(*ends) for name, ends in RANGES.items()})


class Person:
    """Whoever is at the other end of every wire: reasonable for a while, then not."""

    def __init__(self, seed: int, trouble: float) -> None:
        self.draw = random.Random(seed)
        self.trouble = trouble
        self.way = (0.0, 0.0, 0.0)
        self.turn = (0.0, 0.0, 0.0)

    def vector(self, size: float) -> tuple[float, float, float]:
        uniform = self.draw.uniform
        return uniform(-size, size), uniform(-size, size), uniform(-size, size)

    def command(self, measured: Pose) -> Pose | None:
        if self.draw.random() < 0.05:
            self.way, self.turn = self.vector(self.draw.choice((0.03, 0.15))), self.vector(0.5)
        kind = self.draw.random()
        if kind < self.trouble:
            bad = self.draw.choice((math.nan, math.inf, -math.inf, 1e300, 0.0, 3.0, -0.0))
            numbers = [*measured.position, *measured.orientation]
            numbers[self.draw.randrange(7)] = bad
            return Pose(tuple(numbers[:3]), tuple(numbers[3:]))  # type: ignore[arg-type]
        if kind < 0.05 + self.trouble:
            return None
        orientation = turned(unit(measured.orientation), self.turn)
        return Pose(add(measured.position, self.way), orientation)

    def inputs(self, now: float, tool: Pose, measured: Pose) -> GateInputs:
        inputs = GateInputs(
            now=now, measured=measured, state_at=now, speed=0.0, command=self.command(tool),
            tracker_at=now, is_tracked=True, is_home=self.draw.random() < 0.02,
            speed_share=self.draw.choice((1.0, 1.0, 0.3, 0.0)),
        )  # fmt: skip
        if self.draw.random() >= self.trouble:
            return inputs
        age = self.draw.choice((0.03, 0.07, 0.2, math.inf, math.nan))
        changed = self.draw.choice(
            (
                {"state_at": now - age},
                {"tracker_at": now - age},
                {"is_tracked": False},
                {"is_run_stopped": True},
                {"are_motors_halted": True},
                {"generation": 1},
                {"force": self.draw.choice((10.0, 80.0, math.nan))},
                {"effort_share": self.draw.choice((0.1, 2.0, math.nan))},
                {"problems": ("a fault",)},
                {"speed": math.nan},
                {"now": self.draw.choice((now - 1.0, now + 1.0))},
            )
        )
        return msgspec.structs.replace(inputs, **changed)


@settings(
    max_examples=EXAMPLES, deadline=None, derandomize=True,
    suppress_health_check=[HealthCheck.too_slow],
)  # fmt: skip
@given(
    cfg=limits,
    seed=st.integers(0, 2**32),
    trouble=st.sampled_from((0.0, 0.002, 0.01, 0.1)),
    follows=st.sampled_from((0.0, 0.07, 0.5, 1.0)),
    carried=st.sampled_from((0.0, 0.0, 0.02)),
)
def test_no_input_leads_over_a_limit(
    cfg: SafetyConfig, seed: int, trouble: float, follows: float, carried: float
):
    gate = Gate(cfg, BLADE, PERIOD)
    person = Person(seed, trouble)
    memory = GateMemory()
    tool = Pose(START.position, unit(START.orientation))
    now = 0.0
    is_allowed = False  # by a person
    last: Pose | None = None
    velocity = spin = (0.0, 0.0, 0.0)
    for _ in range(STEPS):
        now += PERIOD
        measured = tool
        if person.draw.random() < trouble:
            measured = Pose((math.nan, 0.0, 0.0), tool.orientation)
        inputs = person.inputs(now, tool, measured)
        if not is_allowed and person.draw.random() < 0.3:
            memory, _ = gate.reset(memory, inputs)
            memory, reasons = gate.arm(memory, inputs)
            is_allowed = not reasons
            last, velocity, spin = None, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
            if is_allowed:
                last = Pose(tool.position, unit(tool.orientation))
        elif is_allowed and person.draw.random() < 0.002:
            memory, is_allowed = disarmed(memory, "asked"), False
        was = memory.mode
        memory, output = gate.step(memory, inputs)
        command = output.command
        if not is_allowed or memory.mode in ("disarmed", "tripped"):
            is_allowed = False
            assert command is None
            assert memory.mode in ("disarmed", "tripped")
            assert was != "tripped" or memory.mode == "tripped"
        elif command is None:
            assert memory.mode == "holding"
            assert length(velocity) <= SMALL
        else:
            assert all(map(math.isfinite, (*command.position, *command.orientation)))
            assert abs(math.hypot(*command.orientation) - 1.0) < SMALL
            for low, value, high in zip(cfg.box_low, command.position, cfg.box_high, strict=True):
                assert low - SMALL <= value <= high + SMALL
            assert gate.space.clearance(command) >= -SMALL  # the bat: ceiling and person too
            assert last is not None
            before, spin_before = velocity, spin
            velocity = tuple(
                (a - b) / PERIOD for a, b in zip(command.position, last.position, strict=True)
            )  # type: ignore[assignment]
            turn = rotation_between(last.orientation, command.orientation)
            spin = (turn[0] / PERIOD, turn[1] / PERIOD, turn[2] / PERIOD)
            assert length(velocity) <= cfg.game_speed + SMALL
            assert length(spin) <= cfg.turn_speed + SMALL
            assert distance(velocity, before) <= cfg.acceleration * PERIOD + SMALL
            assert distance(spin, spin_before) <= cfg.turn_acceleration * PERIOD + SMALL
            if carried == 0.0 and follows < 1.0 and measured is tool:
                # A tool that stays or follows is never led further; one that is carried off may be.
                assert distance(command.position, tool.position) <= cfg.lead + SMALL
            last = command
        if last is not None:
            way = add(last.position, tool.position, -1.0)
            tool = Pose(add(tool.position, way, follows), last.orientation)
        if carried and person.draw.random() < 0.05:
            tool = Pose(add(tool.position, person.vector(carried)), tool.orientation)


def test_the_random_steps_are_enough():
    assert EXAMPLES * STEPS >= 100_000
