"""Logs of motors that turn light things become recordings."""

from pathlib import Path

import mujoco
import numpy as np
import pytest

from shared.errors import IdentificationError
from shared.identification.arm.subject import subject_of
from shared.identification.dataset.reading import read_dataset
from studies.other_arms import light_arm
from studies.real_data import airbot, mx106


def test_the_last_rows_of_two_files_are_angles_and_torques_of_an_arm(tmp_path: Path):
    rows = 600
    q = np.linspace(0.1, 0.7, rows)[:, None] * np.arange(1, 7)
    torque = np.sin(0.01 * np.arange(rows))[:, None] * np.arange(1, 7)
    for name, values in zip(airbot.FILES, (q, torque), strict=True):
        np.savetxt(tmp_path / name, values, delimiter=",", header="a,b,c,d,e,f")
    airbot.convert(tmp_path / "set", tmp_path)
    dataset = read_dataset(tmp_path / "set")
    assert [each.split for each in dataset.trajectories] == ["train", "train", "test"]
    first = dataset.trajectories[0]
    assert first.q[0] == pytest.approx(q[-462], abs=1e-6)
    assert first.command[0] == pytest.approx(torque[-462], abs=1e-6)
    model = subject_of(dataset).nominal.model
    data = mujoco.MjData(model)
    data.qpos[:] = [1.57, -0.524, 1.57, 1.57, 1.57, 1.57]
    mujoco.mj_forward(model, data)
    # Where the recording begins, at rest, its motors were read at -2.0 to -2.7 and -1.1 N m.
    assert data.qfrc_bias[[1, 4]] == pytest.approx([-2.5, -1.1], abs=0.6)
    with pytest.raises(IdentificationError, match=r"has no identification_q_real\.csv"):
        airbot.convert(tmp_path / "other", tmp_path / "nowhere")


def test_goals_and_positions_of_a_servo_are_read_by_name(tmp_path: Path):
    at = 0.01 * np.arange(620)
    for name in mx106.MOTIONS:
        (folder := tmp_path / name / "repeat_3").mkdir(parents=True)
        goal = 0.5 * np.sin(at)
        table = np.column_stack([at, 0.0 * at, goal, goal - 0.1])
        header = "time_sec,input_voltage_V,goal_position_rad,real_position_rad"
        np.savetxt(folder / "comparison.csv", table, delimiter=",", header=header, comments="")
    mx106.convert(tmp_path / "set", tmp_path, kp=30.0)
    dataset = read_dataset(tmp_path / "set")
    assert [each.split for each in dataset.trajectories] == ["train", "train", "test"]
    chirp = dataset.trajectories[1]
    assert chirp.joints_at[0] == 0.0
    assert chirp.q[0, 0] == pytest.approx(0.5 * np.sin(2.26) - 0.1, abs=1e-3)
    assert chirp.initial_qd[0] == pytest.approx(0.5 * np.cos(2.26), abs=0.02)
    model = subject_of(dataset).nominal.model
    assert model.actuator_gainprm[0, 0] == 30.0


def test_a_light_arm_with_the_same_seed_hides_the_same(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr(light_arm, "_SECONDS", 3.9)
    hidden = light_arm.make(tmp_path / "set", seed=3)
    dataset = read_dataset(tmp_path / "set")
    assert len(dataset.trajectories) == 6
    assert min(hidden.dry) > 0.0
    assert max(light_arm.drawn(np.random.default_rng(0), is_none=True).dry) == 0.0
    other = light_arm.make(tmp_path / "again", seed=3)
    assert other.viscous == pytest.approx(hidden.viscous)
