"""Checkpoints on a real disk: whole or not there, and the previous one when the newest is bad."""

import resource
from collections.abc import Callable, Generator
from contextlib import contextmanager
from pathlib import Path

import msgspec
import pytest
import torch

from services.learner.checkpoint import CheckpointStore, Meta
from shared.errors import CheckpointError, RiposteError

TENSORS = {
    "actor.weight": torch.arange(12, dtype=torch.float32).reshape(3, 4),
    "random_state": torch.arange(5, dtype=torch.uint8),
    "adam.0.step": torch.tensor(3.0),
}


def meta(version: int, **changes: object) -> Meta:
    plain = Meta(
        run="run-1",
        agent="antagonist",
        seed=7,
        policy_version=version,
        stage=0,
        total_samples=100 * version,
        applied="{}",
        rollouts=("b0:1", "b0:2"),
        metrics=None,
    )
    return msgspec.structs.replace(plain, **changes)


@pytest.fixture
def store(tmp_path: Path) -> CheckpointStore:
    return CheckpointStore(tmp_path, "run-1", "antagonist", keep=3)


@contextmanager
def no_space(limit: int = 64) -> Generator[None]:
    """A disk on which no file gets longer than this (bytes)."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (limit, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


def cut_short(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-3])


def emptied(path: Path) -> None:
    path.write_bytes(b"")


def flipped(path: Path) -> None:
    payload = bytearray(path.read_bytes())
    payload[-2] ^= 0xFF
    path.write_bytes(payload)


def overwritten(path: Path) -> None:
    path.write_bytes(b"\xff" * 200)


def test_a_checkpoint_read_back_is_the_one_written(store: CheckpointStore):
    store.save(meta(4), TENSORS)
    found, tensors = store.load(4)
    assert msgspec.structs.replace(found, tensors="") == meta(4)
    assert tensors.keys() == TENSORS.keys()
    for name, value in TENSORS.items():
        assert torch.equal(tensors[name], value)
        assert tensors[name].dtype == value.dtype
        assert tensors[name].shape == value.shape


def test_only_the_newest_few_are_kept(store: CheckpointStore, tmp_path: Path):
    for version in range(6):
        store.save(meta(version), TENSORS)
    assert store.versions() == [5, 4, 3]
    assert len(list(tmp_path.iterdir())) == 3


def test_there_is_nothing_to_load_in_an_empty_folder(store: CheckpointStore):
    assert store.load_newest() is None
    with pytest.raises(CheckpointError, match=r"cannot read .*00000009.*No such file"):
        store.load(9)


@pytest.mark.parametrize("damage", [cut_short, emptied, flipped, overwritten])
def test_a_damaged_newest_gives_way_to_the_one_before_and_is_named(
    store: CheckpointStore, damage: Callable[[Path], None]
):
    for version in range(3):
        store.save(meta(version), TENSORS)
    damage(store.path(2))
    found = store.load_newest()
    assert found is not None
    assert found[0].policy_version == 1
    (fault,) = found[2]
    assert str(store.path(2)) in fault
    assert "damaged" in fault
    assert "\n" not in fault


def test_when_all_are_damaged_the_error_names_each_and_what_to_do(store: CheckpointStore):
    for version in range(3):
        store.save(meta(version), TENSORS)
        flipped(store.path(version))
    with pytest.raises(CheckpointError, match="no usable checkpoint in") as caught:
        store.load_newest()
    for version in range(3):
        assert str(store.path(version)) in str(caught.value)
    assert "restore one, or start a new run" in str(caught.value)


@pytest.mark.parametrize(
    ("field", "value"), [("run", "run-2"), ("agent", "protagonist"), ("schema", 2)]
)
def test_a_checkpoint_of_something_else_is_refused_by_name(
    store: CheckpointStore, field: str, value: object
):
    store.save(meta(1, **{field: value}), TENSORS)
    with pytest.raises(CheckpointError, match=f"does not belong here: its {field} is {value}"):
        store.load(1)
    with pytest.raises(CheckpointError, match="no usable checkpoint"):
        store.load_newest()


def test_a_full_disk_leaves_the_older_checkpoints_and_no_litter(
    store: CheckpointStore, tmp_path: Path
):
    store.save(meta(0), TENSORS)
    store.save(meta(1), TENSORS)
    with no_space(), pytest.raises(RiposteError, match=r"no space left to write .*00000002"):
        store.save(meta(2), TENSORS)
    assert store.versions() == [1, 0]
    assert len(list(tmp_path.iterdir())) == 2
    found = store.load_newest()
    assert found is not None
    assert (found[0].policy_version, found[2]) == (1, [])
    store.save(meta(2), TENSORS)
    assert store.versions() == [2, 1, 0]


def test_a_full_disk_leaves_the_same_version_as_it_was(store: CheckpointStore):
    store.save(meta(1, stage=0), TENSORS)
    with no_space(), pytest.raises(RiposteError, match="from before is intact"):
        store.save(meta(1, stage=5), TENSORS)
    assert store.load(1)[0].stage == 0


def test_later_versions_can_be_forgotten(store: CheckpointStore):
    for version in range(3):
        store.save(meta(version), TENSORS)
    store.discard_after(0)
    assert store.versions() == [0]


def test_files_of_other_names_are_left_alone(store: CheckpointStore, tmp_path: Path):
    (tmp_path / "checkpoint-notes.txt").write_text("mine")
    (tmp_path / "checkpoint-lastgood.safetensors").write_text("mine too")
    for version in range(5):
        store.save(meta(version), TENSORS)
    assert store.versions() == [4, 3, 2]
    assert (tmp_path / "checkpoint-notes.txt").exists()
    assert (tmp_path / "checkpoint-lastgood.safetensors").exists()
