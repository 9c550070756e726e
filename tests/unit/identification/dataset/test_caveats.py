import numpy as np
import pytest

from shared.identification.dataset.caveats import in_words
from shared.identification.dataset.followed import MIXED_UP
from shared.identification.dataset.reading import read_dataset
from shared.identification.dataset.types import Caveat
from tests.unit.identification.dataset.folders import (
    JOINTS,
    MANIFEST,
    command,
    motion,
    poses,
    table,
    written,
)


def the(folder, name: str) -> Caveat:
    found = [each for each in read_dataset(folder).caveats if each.name == name]
    assert len(found) == 1, [each.name for each in read_dataset(folder).caveats]
    return found[0]


def rewritten(folder, seed, joints, given=None) -> None:
    name = ("one", "two", "three")[seed]
    table(folder / name / "joints.parquet", joints)
    table(folder / name / "command.parquet", command(joints) if given is None else given)


def rows(columns: dict, which) -> dict:
    return {name: values[which] for name, values in columns.items()}


def test_a_hole_is_told_with_its_place(tmp_path):
    folder = written(tmp_path)
    keep = np.ones(400, bool)
    keep[201:220] = False
    table(folder / "two" / "joints.parquet", rows(motion(1), keep))
    found = the(folder, "gap")
    assert found.trajectory == "two"
    assert "joints has 1 holes" in found.text
    assert "0.2 s at 2.000 s" in found.text


def test_times_of_receipt_are_told(tmp_path):
    folder = written(tmp_path)
    joints = motion(1)
    rng = np.random.default_rng(3)
    joints["t_ns"] = joints["t_ns"] + rng.integers(0, 9_000_000, 400)
    table(folder / "two" / "joints.parquet", joints)
    assert "joints come" in the(folder, "jitter").text


@pytest.mark.parametrize("kind", ["range", "speed"])
def test_a_joint_that_hardly_moves_is_told(tmp_path, kind):
    folder = written(tmp_path)
    for seed in range(3):
        joints = motion(seed)
        if kind == "range":
            joints["q_elbow"], joints["qd_elbow"] = (
                joints["q_elbow"] * 0.02,
                joints["qd_elbow"] * 0.02,
            )
        else:
            times = (joints["t_ns"] - joints["t_ns"][0]) / 1e9
            joints["q_elbow"], joints["qd_elbow"] = 0.02 * times, np.full(400, 0.02)
        rewritten(folder, seed, joints)
    assert "joint 'elbow' moves by" in the(folder, "little_excitation").text


def test_readings_that_only_repeat_are_told(tmp_path):
    folder = written(tmp_path)
    joints = motion(1)
    held = np.arange(400) // 2 * 2
    rewritten(folder, 1, {**rows(joints, held), "t_ns": joints["t_ns"]}, command(joints))
    assert "50% of the rows on the way repeat" in the(folder, "held_readings").text


def test_a_joint_that_rests_is_read_anew_all_the_same(tmp_path):
    folder = written(tmp_path)
    joints = motion(1)
    rests = np.minimum(np.arange(400), 150)
    rewritten(folder, 1, {**rows(joints, rests), "t_ns": joints["t_ns"]}, command(joints))
    assert "held_readings" not in [each.name for each in read_dataset(folder).caveats]


def test_a_reading_that_no_joint_was_at_is_told(tmp_path):
    folder = written(tmp_path)
    joints = motion(1)
    joints["q_elbow"][200] = -3.14
    rewritten(folder, 1, joints)
    found = the(folder, "spikes")
    assert "joint 'elbow' jumps away for one reading and back, at 2.000 s" in found.text
    assert "leave such rows out" in found.text


def test_a_coarse_encoder_is_told(tmp_path):
    folder = written(tmp_path)
    joints = motion(1)
    joints["q_elbow"] = np.round(joints["q_elbow"] / 0.01) * 0.01
    rewritten(folder, 1, joints)
    assert "joint 'elbow' is read in steps of 0.01 rad" in the(folder, "quantised").text


def test_a_velocity_of_another_joint_is_told(tmp_path):
    folder = written(tmp_path)
    joints = motion(1)
    joints["qd_elbow"] = np.cos(3.7 * np.arange(400) / 100)
    rewritten(folder, 1, joints)
    assert "'elbow'" in the(folder, "velocity_disagrees").text


def test_a_jump_of_the_tracker_is_told(tmp_path):
    folder = written(tmp_path)
    seen = poses(motion(1))
    seen["x"] = seen["x"] + np.where(np.arange(400) == 100, 0.3, 0.0)
    table(folder / "two" / "tracker.parquet", seen)
    assert "jumps 2 times, the most by 3" in the(folder, "tracker_jump").text


def test_what_is_not_logged_is_told_once_for_the_set(tmp_path):
    folder = written(tmp_path)
    for seed, name in enumerate(("one", "two", "three")):
        (folder / name / "tracker.parquet").unlink()
        joints = motion(seed)
        bare = {key: joints[key] for key in ("t_ns", *(f"q_{each}" for each in JOINTS))}
        rewritten(folder, seed, bare)
    found = read_dataset(folder)
    assert [each.name for each in found.caveats] == [
        "no_repeat", "no_tracker", "no_velocity", "no_effort",
    ]  # fmt: skip
    assert not found.has_tracker
    assert found.trajectories[0].qd is None
    np.testing.assert_array_equal(found.trajectories[0].initial_qd, [0.0, 0.0])


def test_velocities_of_some_joints_are_not_used(tmp_path):
    folder = written(tmp_path)
    joints = motion(1)
    joints["qd_elbow"] = np.full(400, np.nan)
    rewritten(folder, 1, joints)
    assert "elbow is not there" in the(folder, "partial_velocity").text
    assert read_dataset(folder).trajectories[1].qd is None


def test_one_motion_for_all_and_a_test_that_is_train_are_told(tmp_path):
    folder = written(tmp_path)
    for seed in (1, 2):
        noisy = motion(0)
        noisy["q_elbow"] = noisy["q_elbow"] + 1e-4 * seed
        rewritten(folder, seed, noisy, command(motion(0)))
    assert the(folder, "one_program").trajectory == ""
    assert the(folder, "test_is_train").trajectory == "three"


def test_a_repeat_of_another_motion_is_told(tmp_path):
    text = MANIFEST.replace('name = "two"\n', 'name = "two"\nrepeats = "one"\n')
    folder = written(tmp_path, manifest=text)
    found = the(folder, "repeat_differs")
    assert found.trajectory == "two"
    assert "a recording of its own" in found.text
    assert the(folder, "no_repeat").trajectory == ""
    assert [each.name for each in read_dataset(folder).train] == ["one", "two"]


def test_torques_that_a_controller_sends_twice_are_a_repeat_though_they_differ(tmp_path):
    text = MANIFEST.replace('name = "two"\n', 'name = "two"\nrepeats = "one"\n')
    folder = written(tmp_path, manifest=text.replace("position", "torque"))
    assert "more noise than there is" in the(folder, "repeat_differs").text
    assert [each.name for each in read_dataset(folder).train] == ["one"]


def test_a_repeat_may_be_shorter_than_what_it_repeats(tmp_path):
    text = MANIFEST.replace('name = "two"\n', 'name = "two"\nrepeats = "one"\n')
    folder = written(tmp_path, manifest=text)
    first = {name: column[:160] for name, column in motion(0).items()}
    rewritten(folder, 1, first, command(first))
    table(folder / "two" / "tracker.parquet", poses(first))
    found = read_dataset(folder)
    assert "repeat_differs" not in [each.name for each in found.caveats]
    assert [each.repeats for each in found.trajectories if each.name == "two"] == ["one"]


def test_a_repeat_of_the_same_commands_is_fine(tmp_path):
    text = MANIFEST.replace('name = "two"\n', 'name = "two"\nrepeats = "one"\n')
    folder = written(tmp_path, manifest=text)
    later = motion(0)
    later["t_ns"] = later["t_ns"] + 3_600_000_000_000
    later["q_elbow"] = later["q_elbow"] + 1e-5
    rewritten(folder, 1, later, command(later))
    table(folder / "two" / "tracker.parquet", poses(later))
    assert [each.name for each in read_dataset(folder).caveats] == ["one_program"]


def test_a_late_start_of_either_is_told(tmp_path):
    folder = written(tmp_path)
    rewritten(folder, 0, rows(motion(0), slice(30, None)), command(motion(0)))
    rewritten(folder, 1, motion(1), rows(command(motion(1)), slice(40, None)))
    assert "0.3 s after the first command" in the(folder, "late_joints").text
    assert "0.4 s after the first reading" in the(folder, "late_command").text


def test_a_start_in_motion_without_velocities_is_told_and_taken(tmp_path):
    folder = written(tmp_path)
    joints = rows(motion(1), slice(50, None))
    logged = float(joints.pop("qd_elbow")[0]), float(joints.pop("qd_shoulder")[0])
    rewritten(folder, 1, joints)
    assert "rad/s, taken from its first readings" in the(folder, "moving_start").text
    taken = read_dataset(folder).trajectories[1].initial_qd
    assert sorted(taken) == pytest.approx(sorted(logged), rel=0.02, abs=0.02)


def test_a_start_that_may_be_of_rest_is_told_and_taken_for_rest(tmp_path):
    folder = written(tmp_path)
    joints = motion(1)
    del joints["qd_elbow"], joints["qd_shoulder"]
    joints["q_elbow"] = joints["q_elbow"] + 0.0
    joints["q_elbow"][[0, 1, 4, 7]] += 0.03
    rewritten(folder, 1, joints)
    assert "and is taken to start at rest" in the(folder, "moving_start").text
    assert not read_dataset(folder).trajectories[1].initial_qd.any()


def test_a_held_out_motion_much_faster_than_what_is_fitted_to_is_told(tmp_path):
    folder = written(tmp_path)
    quick = motion(2)
    quick["q_elbow"] = quick["q_elbow"][0] + 4.0 * (quick["q_elbow"] - quick["q_elbow"][0])
    quick.pop("qd_elbow")
    quick.pop("qd_shoulder")
    rewritten(folder, 2, quick)
    found = the(folder, "faster_test")
    assert found.trajectory == "three"
    assert "joint 'elbow' goes at up to" in found.text


def test_joints_that_go_at_one_speed_are_told(tmp_path):
    folder = written(tmp_path)
    assert "one_speed" not in {each.name for each in read_dataset(folder).caveats}
    for number in (0, 1):
        even = motion(number)
        count = len(even["q_elbow"])
        way = np.minimum(np.arange(count), count // 2)
        even["q_elbow"] = even["q_elbow"][0] + 0.01 * way
        even.pop("qd_elbow")
        even.pop("qd_shoulder")
        rewritten(folder, number, even)
    found = the(folder, "one_speed")
    assert found.text.startswith("joint 'elbow' goes at 1 to 1 rad/s (m/s)")


def test_what_recordings_share_but_for_its_numbers_is_said_once():
    def of(trajectory: str, text: str) -> Caveat:
        return Caveat("any", trajectory, text)

    said = in_words([
        of("a", "joint 'j_1' is read in steps of 0.00153 rad (m), 253 values"),
        of("a", "joint 'j_2' is read in steps of 0.00153 rad (m), 253 values"),
        of("b", "joint 'j_1' is read in steps of 1.6e-03 rad (m), 9 values"),
        of("", "nothing is known"),
        *(of(f"r{number}", f"late by {number} ms") for number in range(7)),
    ])  # fmt: skip
    assert said == (
        "a: joint 'j_1' is read in steps of 0.00153 rad (m), 253 values (much the same: b)",
        "a: joint 'j_2' is read in steps of 0.00153 rad (m), 253 values",
        "nothing is known",
        "r0: late by 0 ms (much the same: 6 more)",
    )


def test_a_joint_that_goes_the_other_way_than_its_command_is_told(tmp_path):
    folder = written(tmp_path)
    joints = motion(1)
    rewritten(folder, 1, joints, command(joints) | {"elbow": -joints["q_elbow"]})
    found = the(folder, "other_way")
    assert found.trajectory == "two"
    assert "joint 'elbow' goes the other way than its command (correlation -1.00)" in found.text


def test_joints_that_follow_one_another_s_commands_are_told(tmp_path):
    folder = written(tmp_path)
    joints = motion(1)
    times = (joints["t_ns"] - joints["t_ns"][0]) / 1e9
    joints["q_elbow"] = 0.2 * np.sin(7.0 * times)
    joints["qd_elbow"] = 1.4 * np.cos(7.0 * times)
    mixed = {"shoulder": joints["q_elbow"], "elbow": joints["q_shoulder"]}
    rewritten(folder, 1, joints, command(joints) | mixed)
    found = [each for each in read_dataset(folder).caveats if each.name == "other_joint"]
    assert [each.trajectory for each in found] == ["two", "two"]
    assert "joint 'shoulder' follows the command of 'elbow' (correlation 1.00)" in found[0].text
    assert "see whether their columns are mixed up" in found[0].text


def test_a_joint_that_is_told_to_rest_may_sag_along_with_another(tmp_path):
    folder = written(tmp_path)
    joints = motion(1)
    sent = command(joints) | {"elbow": np.zeros(400)}
    joints["q_elbow"], joints["qd_elbow"] = (
        0.1 * joints[f"{kind}_shoulder"] for kind in ("q", "qd")
    )
    rewritten(folder, 1, joints, sent)
    assert not {each.name for each in read_dataset(folder).caveats} & set(MIXED_UP)


def test_positions_that_are_called_torques_are_told(tmp_path):
    folder = written(tmp_path, manifest=MANIFEST.replace("position", "torque"))
    found = [each for each in read_dataset(folder).caveats if each.name == "like_positions"]
    assert [each.trajectory for each in found] == ["one", "two", "three"]
    assert "the torques of shoulder, elbow go with the joints, and as far" in found[0].text


def test_torques_are_not_taken_for_positions(tmp_path):
    folder = written(tmp_path, manifest=MANIFEST.replace("position", "torque"))
    for seed in range(3):
        joints = motion(seed)
        times = (joints["t_ns"] - joints["t_ns"][0]) / 1e9
        sent = {"shoulder": 2.0 * np.cos(2.1 * times), "elbow": 3.0 * joints["q_elbow"]}
        rewritten(folder, seed, joints, command(joints) | sent)
    assert not {each.name for each in read_dataset(folder).caveats} & set(MIXED_UP)


def test_torques_that_are_called_positions_are_told(tmp_path):
    folder = written(tmp_path)
    for seed in range(3):
        if seed == 1:
            assert "as they do in other recordings" in the(folder, "follows_little").text
        joints = motion(seed)
        times = (joints["t_ns"] - joints["t_ns"][0]) / 1e9
        sent = {name: np.sin((9.0 + index) * times) for index, name in enumerate(JOINTS)}
        rewritten(folder, seed, joints, command(joints) | sent)
    found = [each for each in read_dataset(folder).caveats if each.name == "follows_none"]
    assert len(found) == 3
    assert 'write control = "torque"' in found[0].text


@pytest.mark.parametrize("times", [0.4, 1.0, 3.1416])
def test_joints_that_go_another_number_of_times_as_far_are_told(tmp_path, times):
    folder = written(tmp_path)
    joints = motion(1)
    sent = command(joints)
    rewritten(folder, 1, joints, sent | {name: sent[name] / times for name in JOINTS})
    found = [each for each in read_dataset(folder).caveats if each.name == "other_scale"]
    assert len(found) == (0 if times == 1.0 else len(JOINTS))
    assert all("times as far" in each.text for each in found)


def test_of_a_command_that_stands_still_nothing_is_asked(tmp_path):
    folder = written(tmp_path)
    for seed in range(3):
        joints = motion(seed)
        still = {name: np.full(len(joints["t_ns"]), 0.3) for name in JOINTS}
        rewritten(folder, seed, joints, command(joints) | still)
    assert not {each.name for each in read_dataset(folder).caveats} & set(MIXED_UP)


def test_joints_that_move_alike_or_lag_are_told_nothing_of(tmp_path):
    folder = written(tmp_path)
    joints = motion(1)
    joints["q_elbow"], joints["qd_elbow"] = joints["q_shoulder"], joints["qd_shoulder"]
    sent = command(joints)
    late = {name: np.r_[np.full(20, sent[name][0]), sent[name][:-20]] for name in JOINTS}
    rewritten(folder, 1, joints, sent | late)
    names = {each.name for each in read_dataset(folder).caveats}
    assert not names & set(MIXED_UP)
