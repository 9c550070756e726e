"""Real bags, written by rosbags as a robot would, become a data set."""

import argparse
from pathlib import Path

import numpy as np
import pytest
from rosbags.rosbag2 import StoragePlugin

from services.jobs.identify import import_bag
from shared.errors import IdentificationError, RiposteError
from shared.identification.dataset.reading import read_dataset
from shared.identification.dataset.types import Dataset
from shared.sim.parameters import JOINT_NAMES
from tests.integration.identification.dataset.bags import ARM, HALF, Made, angles, moving, write


def imported(folder: Path, *words: object) -> Dataset:
    parser = argparse.ArgumentParser()
    import_bag.add_arguments(parser)
    assert import_bag.run(parser.parse_args([*map(str, words), "--arm", "right"])) == 0
    return read_dataset(folder)


@pytest.mark.parametrize(
    ("version", "plugin"),
    [(1, None), (2, StoragePlugin.SQLITE3), (2, StoragePlugin.MCAP)],
    ids=["ros1", "ros2-sqlite3", "ros2-mcap"],
)
def test_bags_become_a_data_set_of_the_arm_with_times_of_the_headers(
    tmp_path, capsys, version, plugin
):
    made = Made(version)
    bags = [
        write(tmp_path / name, made, moving(made, seed), plugin)
        for seed, name in enumerate(("sines", "swings", "chirp"))
    ]
    found = imported(tmp_path / "set", *bags, tmp_path / "set")
    assert found.source.kind == "pr2"
    assert found.joints == JOINT_NAMES
    assert [(each.name, each.split) for each in found.trajectories] == [
        ("sines", "train"), ("swings", "train"), ("chirp", "test"),
    ]  # fmt: skip
    at = np.arange(300) / 100
    for seed, each in enumerate(found.trajectories):
        np.testing.assert_array_equal(each.joints_at, at)
        np.testing.assert_array_equal(each.command_at, at)
        np.testing.assert_array_equal(each.q, angles(seed, at)[0])
        np.testing.assert_array_equal(each.qd, angles(seed, at)[1])
        np.testing.assert_array_equal(each.effort, 2.0 * each.q)
        np.testing.assert_array_equal(each.command[:, 0], 0.6 + 0.1 * each.q[:, 0])
        assert each.tracker is None
    assert "2 recordings to fit and 1 held out, 9 s of 7 joints" in capsys.readouterr().out


def test_a_tracker_is_brought_into_the_torso_frame(tmp_path):
    made = Made(1)
    bags = [
        write(tmp_path / str(seed), made, moving(made, seed, own_ns=10**18)) for seed in range(2)
    ]
    found = imported(
        tmp_path / "set", *bags, tmp_path / "set", "--tracker-topic", "/vive",
        "--tracker-frame", "1", "0", "0.5", HALF, "0", "0", HALF,
    )  # fmt: skip
    one = found.trajectories[0]
    x, y = one.command[10, :2]
    np.testing.assert_allclose(one.tracker[10], [1.0 - y, x, 0.5, 0, 0, 0, 1], atol=1e-12)
    np.testing.assert_array_equal(one.tracker_at, np.arange(300) / 100)


def test_stamps_of_zero_give_way_to_times_of_receipt_and_that_is_said(tmp_path, capsys):
    made = Made(1)
    bags = [write(tmp_path / f"b{n}", made, moving(made, n, stamps=False)) for n in range(2)]
    found = imported(tmp_path / "set", *bags, tmp_path / "set")
    assert len(found.trajectories[0].joints_at) == 300
    said = capsys.readouterr().out
    assert "b0.bag: /joint_states by time of receipt: stamps of its headers are zero" in said


def test_of_a_single_bag_the_last_quarter_is_held_out(tmp_path):
    made = Made(2)
    bag = write(tmp_path / "all", made, moving(made, 1, seconds=4.0))
    found = imported(tmp_path / "set", bag, tmp_path / "set")
    first, last = found.trajectories
    assert (first.name, first.split, last.name, last.split) == ("all-a", "train", "all-b", "test")
    assert len(first.joints_at) + len(last.joints_at) == 400
    assert len(last.joints_at) == 100
    assert np.abs(last.initial_qd).max() > 0.1


def test_the_bags_to_hold_out_and_the_repeats_may_be_named(tmp_path):
    made = Made(1)
    bags = [write(tmp_path / f"b{n}", made, moving(made, min(n, 1))) for n in range(3)]
    found = imported(
        tmp_path / "set", *bags, tmp_path / "set", "--test", "b0", "--repeats", "b2=b1"
    )
    assert [each.split for each in found.trajectories] == ["test", "train", "train"]
    assert [each.repeats for each in found.trajectories] == ["", "", "b1"]
    with pytest.raises(IdentificationError, match="no bag is called 'b7'"):
        imported(tmp_path / "x", *bags, tmp_path / "x", "--test", "b7")


def test_another_robot_takes_its_positions_from_joint_states(tmp_path):
    made = Made(2)
    (tmp_path / "arm.xml").write_text("<mujoco/>")
    bags = []
    for seed in range(2):
        messages = [each for each in moving(made, seed) if each[0] == "/joint_states"]
        goals = [("/goal", t, m) for _, t, m in messages if len(m.name) == 7]
        bags.append(write(tmp_path / f"b{seed}", made, messages + goals))
    found = imported(
        tmp_path / "set", *bags, tmp_path / "set", "--model", tmp_path / "arm.xml",
        "--control", "torque", "--command-topic", "/goal", "--joints", *ARM[:2],
    )  # fmt: skip
    assert found.joints == found.actuators == ARM[:2]
    assert found.source.path.resolve() == tmp_path / "arm.xml"
    one = found.trajectories[0]
    np.testing.assert_array_equal(one.command, 2.0 * one.q)


def test_a_topic_that_is_not_there_is_told_with_those_that_are(tmp_path):
    made = Made(1)
    bag = write(tmp_path / "b", made, moving(made, 0))
    with pytest.raises(IdentificationError) as error:
        imported(tmp_path / "set", bag, tmp_path / "set", "--joints-topic", "/joints")
    text = str(error.value)
    assert "has no topic /joints; name another with --joints-topic" in text
    assert "/joint_states (sensor_msgs/JointState)" in text
    assert "/vive (geometry_msgs/PoseStamped)" in text


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--arm", "left"], "has all of l_shoulder_pan_joint"),
        (["--joints-topic", "/vive"], "of type geometry_msgs/PoseStamped, expected sensor_msgs"),
        (["--command-topic", "/joint_states"], "expected a pose"),
        (["--tracker-topic", "/vive"], "in frame 'lighthouse', expected 'torso_lift_link'"),
        (["--command-frame", 0, 0, 0, 1, 1, 0, 0], "is of length 1.414, expected 1"),
    ],
)
def test_what_does_not_fit_is_told(tmp_path, words, message):
    made = Made(1)
    bags = [write(tmp_path / f"b{n}", made, moving(made, n)) for n in range(2)]
    parser = argparse.ArgumentParser()
    import_bag.add_arguments(parser)
    found = parser.parse_args([*map(str, bags), str(tmp_path / "set"), *map(str, words)])
    with pytest.raises(IdentificationError, match=message):
        import_bag.run(found)
    assert not (tmp_path / "set").exists()


@pytest.mark.parametrize("version", [1, 2])
def test_a_damaged_bag_is_one_clear_error(tmp_path, version):
    made = Made(version)
    bag = write(tmp_path / "b", made, moving(made, 0, seconds=0.6))
    file = bag if version == 1 else next(bag.glob("*.db3"))
    whole = file.read_bytes()
    rng = np.random.default_rng(1)
    refusals: list[str] = []
    for _ in range(15):
        place, size = int(rng.integers(0, len(whole))), int(rng.integers(1, 200))
        file.write_bytes(whole[:place] + rng.bytes(size) + whole[place + size :])
        out = tmp_path / f"set-{place}"
        try:
            imported(out, bag, out)
        except RiposteError as error:
            refusals.append(str(error))
    assert len(refusals) > 2
    assert not any("\n" in text for text in refusals)


def test_what_is_no_bag_is_told(tmp_path):
    (tmp_path / "b.bag").write_bytes(b"#ROSBAG V2.0\n" + b"\0" * 50)
    with pytest.raises(RiposteError, match=r"b\.bag is no bag of ROS 1"):
        imported(tmp_path / "set", tmp_path / "b.bag", tmp_path / "set")
    with pytest.raises(RiposteError, match="there is no bag"):
        imported(tmp_path / "set", tmp_path / "c.bag", tmp_path / "set")
