"""No programme leaves its limits, whatever the seed: judged by the gate's own code for a PR2."""

import itertools
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from services.jobs.robot.playable import tool_limits
from services.robot_io.config import SafetyConfig
from services.robot_io.limits import Space
from services.robot_io.poses import distance, length, pose_of, rotation_between
from services.robot_io.scene import blade_of
from shared.errors import IdentificationError
from shared.identification.excitation import motions
from shared.identification.excitation.arm import Arm, mjcf_arm, pr2_arm
from shared.identification.excitation.limits import ToolLimits
from shared.identification.excitation.programme import design
from shared.sim.config import SimConfig
from shared.sim.model import FencingModel
from tests.arms import write_arm

SEEDS = st.integers(0, 2**31 - 1)


@pytest.fixture(scope="module")
def arm(tmp_path_factory: pytest.TempPathFactory) -> Arm:
    path = write_arm(tmp_path_factory.mktemp("arm"))
    path.write_text(path.read_text().replace('timestep="0.002"', 'timestep="0.005"'))
    box = ToolLimits((0.2, -0.5, 0.0), (0.75, 0.5, 0.9))
    return mjcf_arm(path, None, "tool", 2.0, box)


@settings(max_examples=4, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(seed=SEEDS, seconds=st.floats(40.0, 60.0))
def test_an_arm_stays_in_its_ranges_speeds_torques_and_box(arm: Arm, seed: int, seconds: float):
    programme = design(arm, seconds, seed)
    limits, tool = arm.limits, arm.limits.tool
    assert tool is not None
    assert 0.7 * seconds < programme.seconds < 1.4 * seconds
    for part, recorded in zip(programme.parts, programme.predicted.trajectories, strict=True):
        assert recorded.tracker is not None
        q = part.command
        assert np.all((q >= limits.low) & (q <= limits.high))
        speed = np.diff(q, axis=0) / motions.PERIOD
        assert np.all(np.abs(speed) <= limits.speed * (1 + 1e-9))
        change = np.diff(speed, axis=0) / motions.PERIOD
        assert np.all(np.abs(change) <= limits.acceleration * (1 + 1e-9))
        for poses in (arm.poses(q), recorded.tracker):
            assert np.all((poses[:, :3] >= tool.box_low) & (poses[:, :3] <= tool.box_high))
    assert np.all(programme.effort <= 1.0)


@pytest.mark.slow
@pytest.mark.parametrize("side", ["right", "left"])
@pytest.mark.parametrize("seed", [0, 7, 2**31 - 1])
def test_every_command_to_a_pr2_is_one_that_its_safety_gate_allows(seed: int, side: str):
    mirrored = side == "left"
    box = {"box_low": (0.35, -0.45, -0.35), "box_high": (0.95, 0.75, 0.55)} if mirrored else {}
    safety = SafetyConfig(**box)
    model = FencingModel.build(SimConfig(arms=("left" if mirrored else "right",) * 2))
    space = Space(safety, blade_of(model))
    programme = design(
        pr2_arm("left" if mirrored else "right", None, tool_limits(safety, model)), 45.0, seed
    )
    for part, recorded in zip(programme.parts, programme.predicted.trajectories, strict=True):
        assert recorded.tracker is not None
        poses = [pose_of(row) for row in part.command]
        assert all(space.allows(pose) for pose in poses)
        ways = [
            (distance(one.position, other.position),
             length(rotation_between(one.orientation, other.orientation)))
            for one, other in itertools.pairwise(poses)
        ]  # fmt: skip
        far, turned = np.array(ways).max(axis=0) / motions.PERIOD
        assert far <= safety.game_speed
        assert turned <= safety.turn_speed
        moved = np.diff([pose.position for pose in poses], 2, axis=0) / motions.PERIOD**2
        assert np.linalg.norm(moved, axis=1).max() <= safety.acceleration
        for pose, tracked in zip(poses, recorded.tracker, strict=True):
            tool = pose_of(tracked)
            assert distance(pose.position, tool.position) <= safety.lead
            turn = length(rotation_between(tool.orientation, pose.orientation))
            assert turn <= safety.turn_lead
    assert np.all(programme.effort <= 1.0)


def test_the_same_seed_gives_the_same_programme_and_another_another(arm: Arm):
    first, again, other = (design(arm, 40.0, seed) for seed in (3, 3, 4))
    for one, two in zip(first.parts, again.parts, strict=True):
        np.testing.assert_array_equal(one.command, two.command)
    assert any(
        one.command.shape != two.command.shape or np.any(one.command != two.command)
        for one, two in zip(first.parts, other.parts, strict=True)
    )


def test_a_repeat_is_the_same_motion_and_what_is_held_out_is_another(arm: Arm):
    programme = design(arm, 40.0, 1)
    parts = {part.plan.name: part for part in programme.parts}
    np.testing.assert_array_equal(parts["sines"].command, parts["sines_again"].command)
    length = len(parts["other_sines"].command)
    assert np.abs(parts["other_sines"].command - parts["sines"].command[:length]).max() > 0.05
    assert {part.plan.split for part in programme.parts if part.plan.name.startswith("other")} == {
        "test"
    }


def test_limits_that_leave_no_room_are_refused(tmp_path: Path):

    path = write_arm(tmp_path)
    nowhere = ToolLimits((2.0, -0.5, 0.0), (3.0, 0.5, 0.9))
    with pytest.raises(IdentificationError, match="outside the limits"):
        design(mjcf_arm(path, None, "tool", 2.0, nowhere), 40.0, 0)
