import resource
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from shared.errors import IdentificationError
from shared.identification.dataset.reading import PR2_JOINTS, read_dataset
from shared.identification.dataset.types import POSE, Dataset, ModelSource, Trajectory
from shared.identification.dataset.writing import write_dataset
from tests.unit.identification.dataset.folders import MANIFEST, written

_BEYOND = '[model]\nencoders = "link"'


def moving(name: str, split: str, seed: int) -> Trajectory:
    rng = np.random.default_rng(seed)
    at = np.arange(100) / 100
    q = rng.normal(size=(100, 7)) * 0.1
    pose = np.tile([0.6, 0.0, 0.1, 1.0, 0.0, 0.0, 0.0], (100, 1))
    return Trajectory(name, split, "", q[0], np.zeros(7), at, pose, at, q)


def pr2(folder: Path) -> Dataset:
    made = (moving("one", "train", 1), moving("two", "test", 2))
    source = ModelSource("pr2", arm="left", parameters=folder / "model.toml")
    return Dataset(folder, source, "pose", PR2_JOINTS, POSE, made, (), "")


def test_units_and_who_wrote_it_are_in_the_folder(tmp_path):
    (tmp_path / "model.toml").write_text("")
    write_dataset(pr2(tmp_path), tmp_path / "set", {"by": "a test", "seed": 3})
    assert read_dataset(tmp_path / "set").source.arm == "left"
    text = (tmp_path / "set" / "dataset.toml").read_text()
    assert '[generator]\nby = "a test"\nseed = 3\n' in text
    assert 'parameters = "../model.toml"' in text
    schema = pq.read_schema(tmp_path / "set" / "one" / "command.parquet")
    assert schema.field("x").metadata[b"unit"] == b"m"
    assert schema.field("t_ns").metadata[b"unit"] == b"ns"


def test_the_side_of_the_encoders_is_written_and_read_again(tmp_path):
    manifest = MANIFEST.replace("[model]", _BEYOND)
    read = read_dataset(written(tmp_path / "told", manifest=manifest))
    write_dataset(read, tmp_path / "again", {})
    assert read_dataset(tmp_path / "again").source.encoders == "link"


def test_a_folder_with_something_in_it_is_left_alone(tmp_path):
    (tmp_path / "model.toml").write_text("")
    (tmp_path / "set").mkdir()
    write_dataset(pr2(tmp_path), tmp_path / "set", {})
    before = (tmp_path / "set" / "dataset.toml").read_bytes()
    with pytest.raises(IdentificationError, match="already there"):
        write_dataset(pr2(tmp_path), tmp_path / "set", {})
    assert (tmp_path / "set" / "dataset.toml").read_bytes() == before


def test_what_could_not_be_read_is_not_written(tmp_path):
    (tmp_path / "model.toml").write_text("")
    good = pr2(tmp_path)
    bad = replace(good.trajectories[0], q=np.full((100, 7), np.nan))
    with pytest.raises(IdentificationError, match="row 0 is nan"):
        write_dataset(replace(good, trajectories=(bad, good.trajectories[1])), tmp_path / "set", {})
    assert [path.name for path in tmp_path.iterdir()] == ["model.toml"]


def test_times_that_do_not_begin_at_zero_are_a_bug_of_the_caller(tmp_path):
    good = pr2(tmp_path)
    late = replace(good.trajectories[0], joints_at=np.arange(1, 101) / 100)
    late = replace(late, command_at=late.joints_at)
    with pytest.raises(ValueError, match="does not begin at 0"):
        write_dataset(replace(good, trajectories=(late,)), tmp_path / "set", {})


def test_joints_that_turned_far_are_written_as_continuous(tmp_path):
    (tmp_path / "model.toml").write_text("")
    good = pr2(tmp_path)
    far = replace(good.trajectories[0], q=good.trajectories[0].q + np.array([0.0] * 6 + [90.0]))
    made = replace(good, trajectories=(far, good.trajectories[1]))
    write_dataset(made, tmp_path / "set", {})
    assert 'continuous = [\n    "wrist_roll",\n]' in (tmp_path / "set/dataset.toml").read_text()


def test_a_small_file_of_very_many_rows_takes_no_memory(tmp_path):
    folder = written(tmp_path)
    path = folder / "two" / "joints.parquet"
    zeros = pa.array(np.zeros(1 << 20))
    columns = {"t_ns": zeros.cast(pa.int64()), **{f"q_{each}": zeros for each in "abcdefgh"}}
    group = pa.table(columns)
    with pq.ParquetWriter(path, group.schema) as writer:
        for _ in range(8):
            writer.write_table(group)
    assert path.stat().st_size < 1 << 20
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    with pytest.raises(IdentificationError, match="has 8388608 rows"):
        read_dataset(folder)
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 64 << 10
