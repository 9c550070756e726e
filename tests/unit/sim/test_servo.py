"""The command path against the controller's own loop, one millisecond at a time."""

import numpy as np
import pytest
from numpy.typing import NDArray

from shared.sim.parameters import CommandParameters
from shared.sim.servo import CommandPath, blend

Float64 = NDArray[np.float64]


def pose(rng: np.random.Generator) -> Float64:
    quaternion = rng.normal(size=4)
    return np.concatenate([rng.normal(size=3), quaternion / np.linalg.norm(quaternion)])


def literal(
    commands: list[Float64], start: Float64, filter_: float, delay_ms: int
) -> list[Float64]:
    """Return the filtered pose after every millisecond, 10 of which make a control step."""
    filtered, out = start, []
    for millisecond in range(10 * len(commands)):
        given = millisecond - delay_ms
        command = commands[given // 10] if given >= 0 else start
        filtered = blend(filtered, command, filter_)
        out.append(filtered)
    return out


def path(filter_: float, delay: float, substeps: int, start: Float64) -> CommandPath:
    made = CommandPath(CommandParameters(filter=filter_, delay=delay), 1, 1, 0.01, substeps)
    made.reset(np.array([0]), start[None])
    return made


@pytest.mark.parametrize("delay_ms", [0, 3, 7, 10, 24, 30])
@pytest.mark.parametrize("filter_", [0.01, 0.3, 1.0])
def test_at_a_millisecond_a_step_the_path_is_the_controllers_loop(filter_: float, delay_ms: int):
    rng = np.random.default_rng(1)
    start, commands = pose(rng), [pose(rng) for _ in range(6)]
    expected = literal(commands, start, filter_, delay_ms)
    made, held = path(filter_, delay_ms / 1000, 10, start), []
    for command in commands:
        made.accept(command[None])
        held += [made.advance(substep)[0] for substep in range(10)]
    for mine, theirs in zip(held, expected, strict=True):
        assert mine[:3] == pytest.approx(theirs[:3], abs=1e-12)
        assert abs(mine[3:] @ theirs[3:]) == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize("delay_ms", [0, 7, 13])
@pytest.mark.parametrize("filter_", [0.01, 0.3, 1.0])
def test_one_long_step_holds_the_mean_of_the_loop_and_ends_where_it_ends(
    filter_: float, delay_ms: int
):
    rng = np.random.default_rng(2)
    start, commands = pose(rng), [pose(rng) for _ in range(5)]
    expected = np.array(literal(commands, start, filter_, delay_ms)).reshape(5, 10, 7)
    made = path(filter_, delay_ms / 1000, 1, start)
    for step, command in enumerate(commands):
        made.accept(command[None])
        held = made.advance(0)[0]
        assert held[:3] == pytest.approx(expected[step, :, :3].mean(axis=0), abs=1e-12)
        filtered = made.state()[0, -7:]
        assert filtered[:3] == pytest.approx(expected[step, -1, :3], abs=1e-12)
        assert abs(filtered[3:] @ expected[step, -1, 3:]) == pytest.approx(1.0, abs=1e-12)


def test_a_blend_turns_the_shorter_way_and_keeps_unit_length():
    start = np.array([0.0, 0, 0, 1, 0, 0, 0])
    angle = 0.2
    end = np.array([1.0, 0, 0, -np.cos(angle / 2), -np.sin(angle / 2), 0, 0])
    half = blend(start, end, 0.5)
    assert half[0] == 0.5
    assert half[3:] == pytest.approx([np.cos(angle / 4), np.sin(angle / 4), 0, 0])
    assert blend(start, start, 0.7) == pytest.approx(start)


def test_a_restored_path_goes_on_bit_for_bit():
    rng = np.random.default_rng(3)
    parameters = CommandParameters(filter=0.05, delay=0.0175)
    first, second = (CommandPath(parameters, 4, 2, 0.01, 2) for _ in range(2))
    poses = np.array([np.concatenate([pose(rng), pose(rng)]) for _ in range(4)])
    for made in (first, second):
        made.reset(np.arange(4), poses)
    for _ in range(3):
        first.accept(poses[rng.permutation(4)])
        first.advance(0), first.advance(1)
    second.restore(first.state())
    assert second.size == first.state().shape[1]
    first.accept(poses), second.accept(poses)
    for substep in range(2):
        assert (first.advance(substep) == second.advance(substep)).all()
