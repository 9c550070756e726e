"""What `riposte robot calibrate` hears, says and writes; robot_io is played by the test."""

import datetime
import json
from pathlib import Path

import numpy as np
import pytest

from services.jobs.robot import command as robot
from services.jobs.robot.calibrate import (
    HEARD_SECONDS,
    POSE_SECONDS,
    Docking,
    Gathering,
    calibration_of,
    finish,
    lines,
    main,
)
from services.robot_io.vive.calibration import load_calibration, save_calibration
from services.robot_io.vive.hand_eye import Refused
from shared.bus.memory import MemoryHub
from shared.clock import ManualClock
from shared.errors import ConfigError, RobotFault
from shared.messages.play import BatStates
from shared.messages.topics import BATS, TRACKER_RAW
from shared.messages.tracking import TrackerRaw
from tests.unit.calibration.making import calibration, pairs, truth

NOW = datetime.datetime(2026, 11, 21, tzinfo=datetime.UTC)


class Robot:
    """Says where tracker and tool are, a hundred times a second."""

    def __init__(self) -> None:
        self.clock = ManualClock(100.0)
        hub = MemoryHub(self.clock)
        self.bus, self.desk = hub.join("robot-io-0"), hub.join("calibrate-1")
        self.said: list[str] = []

    def gathering(self, count: int = 30) -> Gathering:
        return Gathering(self.desk, self.clock, self.said.append, count)

    def hold(
        self, task: Gathering | Docking, tracker: np.ndarray | None, tool: np.ndarray | None,
        seconds: float = 0.7,
    ) -> bool:  # fmt: skip
        """Hold both there; return whether all is gathered."""
        for _ in range(round(seconds * 100)):
            self.clock.advance(0.01)
            self._say(tracker, tool)
            if task.tick():
                return True
        return False

    def _say(self, tracker: np.ndarray | None, tool: np.ndarray | None) -> None:
        tools = np.zeros((2, 7))
        tools[1] = np.eye(7)[3] if tool is None else tool
        self.bus.publish(
            BATS,
            BatStates(
                tick=0, boot="b", at_ns=0, bats=np.zeros((2, 13)), tools=tools,
                is_valid=np.array([False, tool is not None]), seconds=0.0,
            ),
        )  # fmt: skip
        pose = np.eye(7)[3] if tracker is None else tracker
        self.bus.publish(
            TRACKER_RAW,
            TrackerRaw(at_ns=0, serial="LHR-1", pose=pose, is_valid=tracker is not None),
        )


def test_thirty_held_poses_give_the_calibration():
    rng = np.random.default_rng(1)
    known = truth(rng)
    robot_io = Robot()
    gathering = robot_io.gathering()
    trackers, tools = pairs(known, rng)
    for tracker, tool in zip(trackers, tools, strict=True):
        done = robot_io.hold(gathering, tracker, tool)
    assert done
    assert robot_io.said[-1].startswith("pose 30 of 30: turned by 2")
    made = calibration_of(*gathering.collector.arrays(), gathering.serial, NOW)
    assert (made.serial, made.poses, made.rejected) == ("LHR-1", 30, 0)
    base = made.torso_from_base
    found = np.array([*base.position, *base.orientation])
    assert known.error_within_a_metre(found, rng) < 0.006
    assert made.expected_mm < 8.0
    assert lines(Path("v.toml"), made)[0] == "poses         30 used, 0 left out"


def test_poses_that_are_hardly_turned_are_refused_with_the_reason():
    rng = np.random.default_rng(2)
    with pytest.raises(Refused, match="at least 8 are needed"):
        calibration_of(*pairs(truth(rng), rng, degrees=3.0), "LHR-1", NOW)


def test_a_tracker_that_is_lost_is_told_and_its_pose_not_taken():
    robot_io = Robot()
    gathering = robot_io.gathering()
    pose = np.array([0.5, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0])
    robot_io.hold(gathering, pose, pose, 0.4)
    robot_io.hold(gathering, None, pose, 0.2)
    robot_io.hold(gathering, pose, pose, 0.4)
    assert gathering.collector.pairs == []
    assert robot_io.said == [
        "the tracker LHR-1 is lost: turn it towards a base station",
        "the tracker LHR-1 is seen again",
    ]
    robot_io.hold(gathering, pose, pose, 1.0)
    assert robot_io.said[2].startswith("pose 1 of 30: turned by 0 degrees so far")
    assert robot_io.said[3:] == ["this pose is taken already: move on and turn the gripper"]
    robot_io.hold(gathering, pose, None, 1.0)  # no robot, no pair
    assert len(gathering.collector.pairs) == 1
    assert robot_io.said[4:] == [
        "the robot's tool is not known: does its controller run? riposte robot check tells"
    ]


def test_a_robot_io_that_is_silent_or_a_person_who_left_end_it():
    robot_io = Robot()
    gathering = robot_io.gathering()
    robot_io.clock.advance(HEARD_SECONDS + 0.1)
    with pytest.raises(RobotFault, match=r"says nothing of a tracker for 10 s: is it running"):
        gathering.tick()
    gathering = robot_io.gathering()
    pose = np.eye(7)[3]
    for _ in range(round(POSE_SECONDS / 4.0) - 1):
        robot_io.clock.advance(4.0)
        robot_io.hold(gathering, pose, pose, 0.01)
    robot_io.clock.advance(4.0)
    with pytest.raises(RobotFault, match="no new pose for 180 s: nothing was written"):
        robot_io.hold(gathering, pose, pose, 0.01)


def test_an_interruption_writes_nothing():
    robot_io = Robot()
    with pytest.raises(RobotFault, match="interrupted"):
        finish(robot_io.gathering(), robot_io.desk, lambda: True)


def test_a_bat_that_lies_still_is_in_its_dock():
    robot_io = Robot()
    docking = Docking(robot_io.desk, robot_io.clock, robot_io.said.append)
    pose = np.array([1.0, 2.0, 3.0, 1.0, 0.0, 0.0, 0.0])
    for step in range(20):
        assert not robot_io.hold(docking, pose + 0.05 * step * np.eye(7)[0], None, 0.05)
    assert robot_io.hold(docking, pose, None, 1.0)
    assert docking.dock == pytest.approx((1.0, 2.0, 3.0))


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (("--poses", "5"), "--poses 5: expected 15 to 500"),
        (("--poses", "many"), "invalid int value"),
    ],
)
def test_a_bad_command_line_is_one_line(
    words: tuple[str, ...], text: str, capsys: pytest.CaptureFixture[str]
):
    with pytest.raises(SystemExit) as caught:
        robot.main(["calibrate", *words])
    assert caught.value.code == 2
    assert text in capsys.readouterr().err


def test_a_dock_needs_a_calibration_first(tmp_path: Path):
    site = tmp_path / "site.toml"
    site.write_text(f"[vive]\ncalibration = {json.dumps(str(tmp_path / 'none.toml'))}\n")
    with pytest.raises(ConfigError, match=r"no calibration .*none.toml"):
        main([str(site), "--connect", "tcp/127.0.0.1:1", "--dock"])


def test_a_dock_is_kept_with_the_rest(tmp_path: Path):
    made = calibration(made_at=NOW, dock=(1.0, 2.0, 3.0))
    save_calibration(tmp_path / "v.toml", made)
    assert load_calibration(tmp_path / "v.toml").dock == (1.0, 2.0, 3.0)
    assert lines(tmp_path / "v.toml", made) == [
        f"wrote the dock to {tmp_path / 'v.toml'}: restart robot_io"
    ]
