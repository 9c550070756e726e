"""Whatever a data set holds is read back as it was written, times to the ns."""

import tempfile
from pathlib import Path

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from shared.identification.dataset.reading import read_dataset
from shared.identification.dataset.types import POSE, Dataset, ModelSource, Trajectory
from shared.identification.dataset.writing import write_dataset


def risen(rng: np.random.Generator, rows: int, start_ns: int = 0) -> np.ndarray:
    steps = rng.integers(1_000_000, 30_000_000, rows)
    steps[0] = start_ns
    return np.cumsum(steps) / 1e9


def posed(rng: np.random.Generator, rows: int) -> np.ndarray:
    turns = rng.normal(size=(rows, 4))
    turns /= np.linalg.norm(turns, axis=1)[:, None]
    return np.concatenate([rng.normal(size=(rows, 3)), turns], axis=1)


NAMES = st.text(st.characters(codec="utf-8", exclude_characters="\0"), min_size=1, max_size=6)


def dataset(
    seed: int, control: str, joints: list[str], motors: list[str], order: list[str],
    logged: list[bool], tracked: str,
) -> Dataset:  # fmt: skip
    rng = np.random.default_rng(seed)
    actuators = POSE if control == "pose" else tuple(motors)
    made: list[Trajectory] = []
    for index, split in enumerate(order):
        rows, sent = int(rng.integers(60, 120)), int(rng.integers(1, 120))
        command = posed(rng, sent) if control == "pose" else rng.normal(size=(sent, len(actuators)))
        sent_at = risen(rng, sent)
        if made:  # a repeat has the commands of what it repeats
            command, sent_at = made[0].command, made[0].command_at
        qd, effort = (rng.normal(size=(rows, len(joints))) for _ in range(2))
        at = risen(rng, 90, int(rng.integers(-(10**8), 10**8)))
        made.append(Trajectory(
            f"t{index}", split, "t0" if index else "",
            rng.normal(size=len(joints)), rng.normal(size=len(joints)),
            sent_at, command, risen(rng, rows, int(rng.integers(0, 10**9))),
            0.5 * rng.normal(size=(rows, len(joints))),
            qd if logged[0] else None, effort * 1e3 if logged[1] else None,
            at if logged[2 + index] else None, posed(rng, 90) if logged[2 + index] else None,
        ))  # fmt: skip
    source = ModelSource("mjcf", Path("arm.xml"), tracked=tracked)
    return Dataset(Path(), source, control, tuple(joints), actuators, tuple(made), (), "")


@given(
    seed=st.integers(0, 2**32),
    control=st.sampled_from(["pose", "position", "torque"]),
    joints=st.lists(NAMES, min_size=1, max_size=4, unique=True),
    motors=st.lists(NAMES.filter("t_ns".__ne__), min_size=1, max_size=3, unique=True),
    order=st.permutations(["train", "test", "train"]),
    logged=st.lists(st.booleans(), min_size=5, max_size=5),
    tracked=st.sampled_from(["", "hand"]),
)
@settings(max_examples=25, deadline=None)
def test_a_data_set_comes_back_as_it_was_written(
    seed, control, joints, motors, order, logged, tracked
):
    made = dataset(seed, control, joints, motors, order, logged, tracked)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name) / "set"
        made = Dataset(**{
            **made.__dict__, "source": ModelSource("mjcf", folder / "arm.xml", tracked=tracked),
        })  # fmt: skip
        write_dataset(made, folder, {"by": "a test"}, {"arm.xml": b"<mujoco/>"})
        found = read_dataset(folder)
        assert [path.name for path in Path(name).iterdir()] == ["set"]
    for key in ("source", "control", "joints", "actuators"):
        assert getattr(found, key) == getattr(made, key)
    for one, other in zip(found.trajectories, made.trajectories, strict=True):
        for key, value in other.__dict__.items():
            if key.endswith("_at") and value is not None:
                nanoseconds = [np.round(each * 1e9) for each in (getattr(one, key), value)]
                np.testing.assert_array_equal(*nanoseconds)
            is_pose = key == "tracker" or (key == "command" and control == "pose")
            same = _one_sign if is_pose and value is not None else np.asarray
            np.testing.assert_array_equal(same(getattr(one, key)), same(value))


def _one_sign(poses):
    """Return poses with w positive: q and -q are one rotation, and a reader may turn them."""
    return np.c_[poses[:, :3], poses[:, 3:] * np.where(poses[:, 3:4] < 0.0, -1.0, 1.0)]
