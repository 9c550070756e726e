from pathlib import Path

import numpy as np
import pytest
from rerun.chunk import RrdReader

from shared.errors import RiposteError
from shared.telemetry.recording import Recording
from shared.telemetry.rrd import compact, next_recording, recordings, trim


def written(path: Path, *, end: bool = True) -> Path:
    recording = Recording("test", path, None, None)
    for k in range(50):
        recording.curve("training/score/antagonist", (float(k), 0.0, 1.0), k * 10**9, k)
        recording.flush(5.0)
    if end:
        recording.close()
    else:
        recording.give_up_file("the test ends it")
    return path


def rows(path: Path) -> int:
    return sum(c.num_rows for c in RrdReader(path).stream() if not c.is_static)


def test_a_whole_recording_is_left_alone(tmp_path: Path) -> None:
    path = written(tmp_path / "recording.rrd")
    before = path.read_bytes()

    assert trim(path) == 0
    assert path.read_bytes() == before


@pytest.mark.filterwarnings("ignore:RRD file has no footer")
@pytest.mark.parametrize("lost", [0, 1, 17, 400, 3001])
def test_a_torn_recording_can_be_read_to_its_last_whole_message(tmp_path: Path, lost: int) -> None:
    path = written(tmp_path / "recording.rrd", end=False)
    whole = path.read_bytes()
    path.write_bytes(whole[: len(whole) - lost])

    cut = trim(path)

    assert (cut == 0) == (lost == 0)
    assert 40 <= rows(path) <= 50 - (lost > 0)
    assert trim(path) == 0


def test_a_compacted_recording_has_the_same_rows_in_less(tmp_path: Path) -> None:
    path = written(tmp_path / "recording.rrd", end=False)
    size = path.stat().st_size

    assert compact(path)

    assert rows(path) == 50
    assert path.stat().st_size < size / 4
    assert [p.name for p in tmp_path.iterdir()] == ["recording.rrd"]


def test_what_cannot_be_compacted_stays(tmp_path: Path) -> None:
    path = tmp_path / "recording.rrd"
    path.write_bytes(b"RRF2 and nothing else")

    assert not compact(path)

    assert path.read_bytes() == b"RRF2 and nothing else"
    assert [p.name for p in tmp_path.iterdir()] == ["recording.rrd"]


def test_another_file_is_refused_and_left_alone(tmp_path: Path) -> None:
    path = tmp_path / "recording.rrd"
    path.write_bytes(b"not a recording at all")

    with pytest.raises(RiposteError, match="is not a Rerun recording"):
        trim(path)
    assert path.read_bytes() == b"not a recording at all"


def test_a_restarted_recorder_gets_a_new_file(tmp_path: Path) -> None:
    names: list[str] = []
    for _ in range(3):
        path = next_recording(tmp_path)
        path.touch()
        names.append(path.name)
    (tmp_path / "recording-old.rrd").touch()

    assert names == ["recording.rrd", "recording-1.rrd", "recording-2.rrd"]
    assert [path.name for path in recordings(tmp_path)] == names


def test_numbers_of_a_curve_come_back(tmp_path: Path) -> None:
    path = written(tmp_path / "recording.rrd")

    found: dict[int, list[float]] = {}
    for chunk in RrdReader(path).stream():
        if chunk.entity_path == "/training/score/antagonist" and not chunk.is_static:
            batch = chunk.to_record_batch()
            samples = batch.column("total_samples").to_pylist()
            found |= dict(zip(samples, batch.column("Scalars:scalars").to_pylist(), strict=True))
    assert found == {k: [float(k), 0.0, 1.0] for k in range(50)}
    assert np.isfinite(list(found)).all()
