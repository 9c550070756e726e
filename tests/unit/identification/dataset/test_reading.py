import numpy as np
import pytest

from shared.errors import IdentificationError
from shared.identification.dataset.reading import read_dataset
from tests.unit.identification.dataset.folders import (
    JOINTS,
    MANIFEST,
    command,
    motion,
    poses,
    table,
    written,
)


def refusal(folder) -> str:
    with pytest.raises(IdentificationError) as error:
        read_dataset(folder)
    return str(error.value)


def caveat_names(folder) -> list[str]:
    return [each.name for each in read_dataset(folder).caveats]


@pytest.mark.parametrize("suffix", [".parquet", ".csv"])
def test_a_folder_becomes_arrays_in_seconds_from_zero(tmp_path, suffix):
    found = read_dataset(written(tmp_path / "set", suffix))
    assert found.joints == found.actuators == JOINTS
    assert found.control == "position"
    assert [each.name for each in found.train] == ["one", "two"]
    assert [each.name for each in found.test] == ["three"]
    one, wanted = found.trajectories[0], motion(0)
    np.testing.assert_array_equal(one.joints_at, np.arange(400) / 100)
    np.testing.assert_array_equal(one.command_at, one.joints_at)
    np.testing.assert_allclose(one.q[:, 1], wanted["q_elbow"], rtol=1e-15)
    np.testing.assert_allclose(one.qd[:, 0], wanted["qd_shoulder"], rtol=1e-15)
    np.testing.assert_allclose(one.effort[:, 1], wanted["effort_elbow"], rtol=1e-15)
    np.testing.assert_array_equal(one.initial_q, one.q[0])
    np.testing.assert_array_equal(one.initial_qd, one.qd[0])
    assert one.tracker.shape == (400, 7)
    assert found.has_tracker
    assert found.source.path == tmp_path / "set" / "arm.xml"


def test_a_sound_set_has_one_caveat_that_nothing_is_repeated(tmp_path):
    assert caveat_names(written(tmp_path)) == ["no_repeat"]


def test_the_hash_is_of_the_files(tmp_path):
    first = read_dataset(written(tmp_path / "a")).hash
    assert read_dataset(written(tmp_path / "b")).hash == first
    table(tmp_path / "b" / "one" / "joints.parquet", motion(5))
    assert read_dataset(tmp_path / "b").hash != first


def test_columns_come_in_one_order_whatever_that_of_the_files(tmp_path):
    folder = written(tmp_path)
    joints = motion(1)
    table(folder / "two" / "joints.parquet", dict(reversed(joints.items())))
    found = read_dataset(folder)
    np.testing.assert_array_equal(found.trajectories[1].q[:, 0], joints["q_shoulder"])


def test_exact_types_are_taken(tmp_path):
    folder = written(tmp_path)
    joints = motion(0)
    joints["t_ns"] = joints["t_ns"].astype("datetime64[ns]")
    joints = {k: v.astype(np.float32) if k != "t_ns" else v for k, v in joints.items()}
    table(folder / "one" / "joints.parquet", joints)
    moved = command(motion(0))
    moved["t_ns"] = (moved["t_ns"] // 1000).astype("datetime64[us]")
    table(folder / "one" / "command.parquet", moved)
    found = read_dataset(folder).trajectories[0]
    np.testing.assert_array_equal(found.joints_at, np.arange(400) / 100)
    np.testing.assert_array_equal(found.command_at, np.arange(400) / 100)


def test_a_pr2_takes_the_names_of_the_robot_and_leaves_other_joints(tmp_path):
    folder = written(
        tmp_path,
        manifest=MANIFEST.replace('kind = "mjcf"\npath = "arm.xml"', 'kind = "pr2"').replace(
            '"position"', '"pose"'
        ),
    )
    names = ("shoulder_pan", "shoulder_lift", "upper_arm_roll", "elbow_flex", "forearm_roll",
             "wrist_flex", "wrist_roll")  # fmt: skip
    for seed, name in enumerate(("one", "two", "three")):
        joints = motion(seed)
        columns = {f"q_r_{each}_joint": joints["q_elbow"] for each in reversed(names)}
        columns["q_l_elbow_flex_joint"] = joints["q_elbow"]
        table(folder / name / "joints.parquet", {"t_ns": joints["t_ns"], **columns})
        table(folder / name / "command.parquet", poses(joints))
    found = read_dataset(folder)
    assert found.joints == names
    assert found.trajectories[0].command.shape == (400, 7)
    assert "joints.parquet: q_l_elbow_flex_joint" in {
        each.name: each.text for each in found.caveats
    }["ignored_columns"]  # fmt: skip


def test_the_initial_state_may_be_given(tmp_path):
    text = MANIFEST.replace(
        'split = "test"',
        'split = "test"\ninitial = {elbow = 0.25}\ninitial_velocity = {shoulder = -1}',
    )
    last = read_dataset(written(tmp_path, manifest=text)).trajectories[2]
    assert last.initial_q[1] == 0.25
    assert last.initial_q[0] == last.q[0, 0]
    assert last.initial_qd[0] == -1.0


def test_a_tracker_of_another_epoch_starts_with_the_others(tmp_path):
    folder = written(tmp_path)
    table(folder / "two" / "tracker.parquet", poses(motion(1), -1_600_000_000_000_000_000))
    found = read_dataset(folder)
    assert found.trajectories[1].tracker_at[0] == 0.0
    assert [each.trajectory for each in found.caveats if each.name == "tracker_clock"] == ["two"]


def test_a_tracker_some_milliseconds_late_stays_so(tmp_path):
    folder = written(tmp_path)
    table(folder / "two" / "tracker.parquet", poses(motion(1), 123_000_001))
    assert read_dataset(folder).trajectories[1].tracker_at[0] == 0.123000001


def test_angles_that_jump_by_a_turn_are_made_continuous(tmp_path):
    folder = written(tmp_path)
    joints = motion(1)
    straight = 2.8 + joints["q_elbow"]
    joints["q_elbow"] = (straight + np.pi) % (2.0 * np.pi) - np.pi
    table(folder / "two" / "joints.parquet", joints)
    found = read_dataset(folder)
    np.testing.assert_allclose(found.trajectories[1].q[:, 1], straight, atol=1e-12)
    assert "unwrapped" in [each.name for each in found.caveats]


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("schema = 1", "schema = 2", "schema is 2"),
        ("schema = 1", "schema = true", "schema is True"),
        ('split = "test"', 'split = "train"', 'no trajectory has split = "test"'),
        ('split = "test"', 'split = "tests"', "dataset.toml:14"),
        ('name = "two"', 'nmae = "two"', "toml:10: trajectory[2].nmae: unknown field; did you"),
        ('kind = "mjcf"', 'kind = "mjfc"', "enum value 'mjfc'; expected 'pr2', 'mjcf'"),
        ('path = "arm.xml"', "", "needs path"),
        ('path = "arm.xml"', 'path = "arm.xml"\nencoders = "load"', "model.encoders: invalid enum"),
        ('kind = "mjcf"\npath = "arm.xml"', 'kind = "pr2"\nencoders = "link"', "take them out"),
        ('path = "arm.xml"', 'path = "leg.xml"', "leg.xml is missing"),
        ('name = "two"', 'name = "one"', "2 trajectories are called 'one'"),
        ('name = "two"', 'name = "../two"', "name of a folder"),
        ('split = "test"', 'split = "test"\nrepeats = "on"', "did you mean 'one'?"),
        ('split = "test"', 'split = "test"\ninitial = {elbw = 0.0}', "did you mean 'elbow'?"),
        ('split = "test"', 'split = "test"\ninitial = {elbow = nan}', "is nan"),
        ("schema = 1", 'schema = 1\ncontinuous = ["elbw"]', "did you mean 'elbow'?"),
        ("schema = 1", "schema = 1\nschema = 1", "not TOML"),
        ("schema = 1", "a = " + "[" * 5000, "nested too deeply"),
    ],
)
def test_a_mistake_in_the_manifest_is_told(tmp_path, old, new, words):
    assert words in refusal(written(tmp_path, manifest=MANIFEST.replace(old, new)))


def changed(folder, file, change) -> None:
    joints = motion(1)
    columns = {"joints": joints, "command": command(joints), "tracker": poses(joints)}[file]
    change(columns)
    table(folder / "two" / f"{file}.parquet", columns)


def put(name, row, value):
    def change(columns):
        columns[name] = columns[name].copy()
        columns[name][row] = value

    return change


def scale(factor, *names):
    def change(columns):
        for name in names:
            columns[name] = columns[name] * factor

    return change


def drop(name):
    return lambda columns: columns.pop(name)


def rename(old, new):
    def change(columns):
        columns[new] = columns.pop(old)

    return change


def times(of):
    def change(columns):
        columns["t_ns"] = of(columns["t_ns"])

    return change


@pytest.mark.parametrize(
    ("file", "change", "words"),
    [
        ("joints", drop("t_ns"), "no column 't_ns'"),
        ("joints", drop("q_elbow"), "'qd_elbow' but no 'q_elbow'; it has q of shoulder: log it"),
        ("joints", rename("q_elbow", "q_Elbow"), "no 'q_elbow'; did you mean 'Elbow'?"),
        ("command", drop("elbow"), "differ in 'elbow' of their command tables"),
        ("tracker", drop("qy"), "no column 'qy'"),
        ("joints", put("q_elbow", 17, np.nan), "column 'q_elbow', row 17 is nan"),
        ("command", put("elbow", 3, np.inf), "column 'elbow', row 3 is inf"),
        ("tracker", put("x", 5, 1e3), "column 'x', row 5 is 1000 m"),
        ("tracker", put("qw", 5, 0.5), "row 5 has the quaternion"),
        ("joints", times(lambda t: t[::-1]), "times must rise; sort the rows"),
        ("joints", times(lambda t: t // 10**9), "times must rise; most are alike"),
        ("joints", times(lambda t: t - t % 20_000_000), "the same as row 0"),
        ("joints", times(lambda t: t / 1e9), "whole nanoseconds"),
        ("joints", times(lambda t: t // 1000), "looks like microseconds"),
        ("joints", times(lambda t: t // 1_000_000), "looks like milliseconds"),
        ("joints", times(lambda t: t // 10_000_000), "looks like"),
        ("joints", times(lambda t: (t - t[0]) * 10**6), "at most 86400 s is read"),
        ("joints", times(lambda t: t - 10**18), "they do not overlap"),
        ("joints", times(lambda t: t[0] + (t - t[0]) // 10), "spans 0.399 s, at least 0.5 s"),
        ("joints", scale(180 / np.pi, "qd_elbow"), "looks like deg/s"),
        ("joints", scale(np.pi / 180, "qd_elbow"), "positions look like degrees"),
        ("joints", scale(180 / np.pi, "q_elbow"), "are these degrees or mm?"),
        ("joints", scale(1e3, "qd_elbow"), "looks like mrad/s"),
        ("command", scale(180 / np.pi, "elbow"), "the command looks like degrees"),
        ("command", scale(1e-3, "elbow"), "the reading looks like mrad or mm"),
        ("joints", scale(-1.0, "qd_elbow"), "other sign"),
        ("joints", scale(180.0, "q_elbow", "qd_elbow"), "are these degrees or mm?"),
        ("joints", scale(1e6, "effort_elbow"), "mN m"),
        ("tracker", times(lambda t: t + 4 * 10**9), "overlaps the joint readings by 0 s"),
    ],
)
def test_a_mistake_in_a_table_is_told(tmp_path, file, change, words):
    folder = written(tmp_path)
    changed(folder, file, change)
    text = refusal(folder)
    assert words in text
    assert file in text


def test_text_in_a_column_of_numbers_is_refused(tmp_path):
    folder = written(tmp_path)
    changed(folder, "joints", lambda columns: columns.update(q_elbow=["0.1"] * 400))
    assert "column 'q_elbow' holds string, expected numbers" in refusal(folder)


def test_a_table_that_is_there_twice_or_not_at_all_is_refused(tmp_path):
    folder = written(tmp_path)
    (folder / "two" / "joints.csv").write_text("t_ns\n")
    assert "both there" in refusal(folder)
    (folder / "two" / "joints.csv").unlink()
    (folder / "two" / "joints.parquet").unlink()
    assert "joints.parquet is missing (or joints.csv)" in refusal(folder)


def test_a_csv_with_semicolons_is_told_to_use_commas(tmp_path):
    folder = written(tmp_path, ".csv")
    (folder / "two" / "joints.csv").write_text("t_ns;q_elbow\n0;0,1\n")
    assert "separate columns by commas" in refusal(folder)


def test_times_in_a_csv_may_have_a_decimal_point(tmp_path):
    folder = written(tmp_path, ".csv")
    joints = motion(1)
    joints["t_ns"] = (joints["t_ns"] - joints["t_ns"][0]).astype(np.float64)
    path = folder / "two" / "joints.csv"
    np.savetxt(path, np.stack(list(joints.values()), 1), delimiter=", ", comments="",
               header=", ".join(joints))  # fmt: skip
    table(folder / "two" / "command.csv", {**command(joints), "t_ns": joints["t_ns"]})
    (folder / "two" / "tracker.csv").unlink()
    np.testing.assert_array_equal(
        read_dataset(folder).trajectories[1].joints_at, np.arange(400) / 100
    )


def test_seconds_in_a_csv_are_told(tmp_path):
    folder = written(tmp_path, ".csv")
    joints = motion(1)
    joints["t_ns"] = (joints["t_ns"] - joints["t_ns"][0]) / 1e9
    table(folder / "two" / "joints.csv", joints)
    assert "column 't_ns', row 1 is 0.01, expected whole nanoseconds" in refusal(folder)


def test_a_recording_copied_to_the_test_side_is_refused(tmp_path):
    folder = written(tmp_path)
    table(folder / "three" / "joints.parquet", motion(0))
    assert "has the same readings as 'one' (train)" in refusal(folder)


def test_a_joint_that_turns_without_end_may_be_named(tmp_path):
    folder = written(tmp_path)
    joints = motion(1)
    joints["q_elbow"] = joints["q_elbow"] + 400.0
    table(folder / "two" / "joints.parquet", joints)
    assert "add it to continuous" in refusal(folder)
    (folder / "dataset.toml").write_text('continuous = ["elbow"]\n' + MANIFEST)
    assert read_dataset(folder).trajectories[1].q[0, 1] == 400.0


def test_too_many_rows_are_refused_before_they_are_read(tmp_path, monkeypatch):
    folder = written(tmp_path)
    monkeypatch.setattr("shared.identification.dataset.tables.MAX_ROWS", 300)
    assert "has 400 rows of" in refusal(folder)


def test_a_command_that_goes_further_than_the_joint_is_no_other_unit(tmp_path):
    folder = written(tmp_path)
    changed(folder, "command", scale(3.0, "elbow"))
    assert read_dataset(folder).trajectories[1].command[:, 1].max() > 2.0


@pytest.mark.parametrize("rows", [2, 3, 5, 9])
def test_very_few_rows_are_enough_to_be_read(tmp_path, rows):
    folder = written(tmp_path)
    which = np.linspace(0, 399, rows).astype(int)
    for seed, name in enumerate(("one", "two", "three")):
        joints = motion(seed)
        sparse = {key: values[which] for key, values in joints.items()}
        table(folder / name / "joints.parquet", sparse)
        first = {key: values[:1] for key, values in command(joints).items()}
        table(folder / name / "command.parquet", first)
        (folder / name / "tracker.parquet").unlink()
    found = read_dataset(folder)
    assert found.trajectories[0].q.shape == (rows, 2)
    assert found.trajectories[0].command.shape == (1, 2)
