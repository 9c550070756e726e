import argparse
import tomllib
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from services.jobs.identify import excite
from shared.errors import ConfigError, IdentificationError
from shared.identification.catalogue import command_latency, torque_saturation
from shared.identification.dataset.reading import read_dataset
from shared.identification.excitation.arm import mjcf_arm
from shared.identification.excitation.prediction import assumed_noise, predict
from shared.identification.excitation.programme import design
from shared.identification.excitation.writing import write_programme
from tests.arms import write_arm


def arguments(*words: str) -> argparse.Namespace:
    parser = argparse.ArgumentParser()
    excite.add_arguments(parser)
    return parser.parse_args(words)


def test_with_what_the_robot_logs_beside_it_a_programme_is_a_data_set(tmp_path: Path):
    path = write_arm(tmp_path)
    path.write_text(path.read_text().replace('timestep="0.002"', 'timestep="0.005"'))
    programme = design(mjcf_arm(path, None, "tool", 2.0, None), 40.0, 2)
    noise = assumed_noise(3)
    prediction = predict(programme.predicted, noise, (command_latency.EFFECT,))
    folder = tmp_path / "programme"
    write_programme(programme, prediction, folder, {"seed": 2}, b"picture")
    for each in programme.predicted.trajectories:
        columns = {"t_ns": (each.joints_at * 1e9).round().astype("int64")}
        columns |= {f"q_{name}": each.q[:, k] for k, name in enumerate(("pan", "lift", "elbow"))}
        pq.write_table(pa.table(columns), folder / each.name / "joints.parquet")
    found = read_dataset(folder)
    assert [each.name for each in found.test] == ["other_sines", "other_swings"]
    assert found.control == "position"
    for each, part in zip(found.trajectories, programme.parts, strict=True):
        assert each.command == pytest.approx(part.command)
    told = tomllib.loads((folder / "programme.toml").read_text())
    assert told["effect"][0]["name"] == "command_latency"
    assert told["effect"][0]["visible"]
    assert (folder / "programme.png").read_bytes() == b"picture"


def test_a_command_line_that_cannot_be_is_one_clear_error(tmp_path: Path):

    with pytest.raises(ConfigError, match="lowest x y z come first"):
        excite.run(arguments("--safe-box", "1", "0", "0", "0", "1", "1"))
    with pytest.raises(ConfigError, match="0 to 1"):
        excite.run(arguments("--require", "2"))
    (tmp_path / "full").mkdir()
    (tmp_path / "full/file").touch()
    with pytest.raises(IdentificationError, match="already there"):
        excite.run(arguments("--out", str(tmp_path / "full")))
    with pytest.raises(IdentificationError, match="can be planned"):
        excite.run(arguments("--seconds", "5", "--out", str(tmp_path / "new")))
    assert not (tmp_path / "new").exists()


@pytest.mark.slow
def test_a_programme_that_shows_too_little_is_refused_and_not_written(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
):
    few = (command_latency.EFFECT, torque_saturation.EFFECT)
    monkeypatch.setattr(excite, "effects", lambda: few)
    path = write_arm(tmp_path)
    path.write_text(path.read_text().replace('timestep="0.002"', 'timestep="0.005"'))
    out = tmp_path / "out"
    words = [str(path), "--out", str(out), "--seconds", "40", "--joint-speed", "1.5"]
    assert excite.run(arguments(*words, "--require", "1.0")) == 2
    said = capsys.readouterr().out
    assert "refused" in said
    assert "NOT SEEN" in said
    assert not out.exists()
    assert excite.run(arguments(*words, "--require", "0.1")) == 0
    assert (out / "programme.png").stat().st_size > 10_000
    assert (out / "swings/command.parquet").exists()
