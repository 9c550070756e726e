from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from shared.identification.arm.segments import segments_of, thinned
from shared.identification.arm.subject import recorded_of, subject_of
from shared.identification.dataset.types import Dataset, ModelSource, Trajectory
from shared.sim.plant.rollouts import Rollouts
from tests.measured import measure

_PENDULUM = """<mujoco><option timestep="{timestep}"/><worldbody><body name="link">
<joint name="hinge" axis="0 1 0"/><inertial pos="0 0 -0.3" mass="1" diaginertia="0.01 0.01 0.01"/>
</body></worldbody><actuator><motor name="hinge" joint="hinge"/></actuator></mujoco>"""


def _swinging(folder: Path, timestep: float) -> Dataset:
    """A pendulum let go at 1 rad, as a simulation at 0.05 ms has it, to be replayed coarsely."""
    path = folder / "link.xml"
    at = 0.002 * np.arange(1000, dtype=np.float64)
    still = np.zeros((len(at), 1))
    start = Trajectory(
        "swing", "train", "", np.ones(1), np.zeros(1), at, still, at, still, qd=None
    )  # fmt: skip
    path.write_text(_PENDULUM.format(timestep=5e-5))
    exact = _dataset(folder, path, start)
    q = Rollouts(subject_of(exact).plant, (), 1).run([(lambda row: None, recorded_of(exact)[0])])
    path.write_text(_PENDULUM.format(timestep=timestep))
    swing = Trajectory("swing", "train", "", np.ones(1), np.zeros(1), at, still, at, q[0].q)
    return _dataset(folder, path, swing)


def _dataset(folder: Path, path: Path, trajectory: Trajectory) -> Dataset:
    source = ModelSource("mjcf", path)
    return Dataset(folder, source, "torque", ("hinge",), ("hinge",), (trajectory,), (), "")


@pytest.mark.parametrize("timestep", [0.002, 0.004])
def test_parts_under_torque_control_replay_a_swing_to_the_second_order(
    tmp_path: Path, timestep: float
):
    dataset = _swinging(tmp_path, timestep)
    subject = subject_of(dataset)
    segments = segments_of(dataset, subject)
    found = subject.nominal.run([(lambda row: None, each.recorded) for each in segments])
    off = max(
        float(np.abs(one.q - each.q).max()) for one, each in zip(found, segments, strict=True)
    )
    # A start half a step late is off by up to 25 rad/s^2 h/2 0.3 s: 7.5 and 15 mrad.
    assert off < 1e-3


def test_no_reading_is_of_two_parts(tmp_path: Path):
    dataset = _swinging(tmp_path, 0.002)
    segments = segments_of(dataset, subject_of(dataset), 0.1)
    at = np.concatenate([each.recorded.begin + each.recorded.joints_at for each in segments])
    assert np.diff(at).min() > 1e-3


def test_a_part_is_put_off_while_a_joint_turns_round(tmp_path: Path):
    """To and fro at 1 rad/s: by the clock, every 0.3 s, parts would begin while it turns."""
    at = 0.002 * np.arange(2000, dtype=np.float64)
    q = np.abs((at + 0.13) % 1.1 - 0.55)[:, None]
    path = tmp_path / "link.xml"
    path.write_text(_PENDULUM.format(timestep=0.002))
    swing = Trajectory("swing", "train", "", q[0], np.zeros(1), at, 0.0 * q, at, q)
    dataset = _dataset(tmp_path, path, swing)
    segments = segments_of(dataset, subject_of(dataset))
    begins = np.array([each.recorded.begin for each in segments])
    turns = 0.55 * np.arange(9) - 0.13
    assert np.abs(begins[:, None] - turns).min() > 0.025
    assert np.diff(begins).min() > 0.3 - 1e-9
    assert np.diff(begins).max() < 0.4 + 1e-9
    assert {len(each.q) for each in segments[:-1]} <= {149, 150, 151}
    for each in segments:
        assert each.recorded.initial_q[0] == pytest.approx(
            np.interp(each.recorded.begin, at, q[:, 0]), abs=1e-6
        )


@pytest.mark.parametrize(("seconds", "count", "every"), [(4.4, 4, 2), (3.4, 3, 2), (15.4, 15, 3)])
def test_some_parts_are_of_other_times_in_the_next_recording(
    tmp_path: Path, seconds: float, count: int, every: int
):
    measured = measure(tmp_path, np.random.default_rng(0), seconds=seconds)
    three = tuple(replace(each, split="train", repeats="") for each in measured.trajectories)
    dataset = replace(measured, trajectories=three)
    segments = segments_of(dataset, subject_of(dataset), 1.0)
    assert len(segments) == 3 * count
    each = [range(index * count, (index + 1) * count) for index in range(3)]
    some = thinned(segments, range(3 * count))
    expected = [own[turn % every :: every] for turn, own in enumerate(each)]
    assert some == tuple(index for own in expected for index in own)
    assert thinned(segments, each[1]) == tuple(each[1][::2])
    assert thinned(segments, (0,)) == (0,)
