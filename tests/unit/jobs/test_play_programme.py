from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from services.jobs.identify.from_bouts import of_bouts
from services.jobs.robot.player import offset_between
from services.robot_io.poses import Pose, pose_of, turned
from shared.errors import IdentificationError
from shared.messages.play import DesiredOffset
from shared.messages.topics import OFFSET
from shared.policy.action import desired_pose
from shared.telemetry.archive import archived_bouts, load_bout
from tests.unit.jobs.programme_stage import Stage, plan_in


@pytest.fixture
def stage(tmp_path: Path) -> Iterator[Stage]:
    stage = Stage(tmp_path / "run", plan_in(tmp_path / "programme", "one", "two"))
    yield stage
    stage.close()


def test_a_programme_becomes_recordings_and_these_a_data_set(stage: Stage, tmp_path: Path):
    stage.arm()
    stage.until("done")
    assert (stage.player.problem, stage.player.played) == ("", ["one", "two"])
    assert "one in 1 s" in stage.said
    stage.player.stop("over")
    stage.run(2.0)
    stage.site.recorder.close()
    bouts = [load_bout(folder) for folder in archived_bouts(stage.folder)]
    plan = stage.player.plan
    dataset, left_out = of_bouts(bouts, plan=plan)
    assert not left_out
    assert [(each.name, each.split) for each in dataset.trajectories] == [
        ("one", "train"), ("two", "test"),
    ]  # fmt: skip
    for each, stretch in zip(dataset.trajectories, plan.stretches, strict=True):
        # What the gate sent is what was designed, at the instants it was designed for.
        assert np.allclose(np.diff(each.command_at), 0.01, atol=1e-6)
        sent = each.command[1 : len(stretch.poses) + 1]  # before it: what held
        assert np.abs(sent[:, :3] - stretch.poses[:, :3]).max() < 2e-3
        assert np.ptp(each.command[:, 1]) == pytest.approx(np.ptp(stretch.poses[:, 1]), abs=2e-3)
        assert np.ptp(each.q, axis=0).max() > 0.02
    with pytest.raises(IdentificationError, match="two was not played to its end"):
        of_bouts(bouts[:1], plan=plan)


def test_nothing_is_played_before_a_person_has_armed_the_robot(stage: Stage):
    stage.until("waiting")
    stage.run(1.5)
    assert stage.player.step == "waiting"
    stage.run(1.0)
    assert "nobody armed the robot for 2 s" in stage.player.problem


def test_disarming_ends_the_programme_and_the_recording(stage: Stage):
    stage.arm()
    stage.until("playing")
    stage.run(0.5)
    assert stage.site.ask(stage.bus, "disarm").accepted
    stage.run(0.1)
    assert stage.player.problem.startswith("the robot is disarmed")
    stage.player.stop("test")
    stage.run(0.2)
    assert stage.site.referee.state().phase == "void"


def test_it_does_not_play_beside_a_policy(stage: Stage):
    stage.until("waiting")
    answer = DesiredOffset(
        agent="protagonist", tick=1, boot="b", snapshot="sha256:0", offset=np.zeros(6), took_ms=0.0
    )
    stage.site.join("policy-0").publish(OFFSET, answer, agent="protagonist")
    stage.run(0.1)
    assert "a policy plays the robot (sha256:0)" in stage.player.problem


def test_an_offset_leads_to_the_pose_it_is_made_for():
    tool = pose_of(np.array([0.6, -0.2, 0.1, 0.8, 0.0, 0.6, 0.0]))
    wanted = Pose((0.65, -0.25, 0.12), turned(tool.orientation, (0.1, -0.3, 0.2)))
    start = np.array([*tool.position, *tool.orientation])
    there = desired_pose(offset_between(tool, wanted)[:, None], start[:, None])[:, 0]
    there[3:] /= np.linalg.norm(there[3:])
    assert there == pytest.approx([*wanted.position, *wanted.orientation])
