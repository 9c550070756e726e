"""What is kept out of the recording: warm-up bouts, and where it is asked for the heart at rest."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from msgspec.structs import replace
from rerun.chunk import RrdReader
from structlog.testing import capture_logs

from shared.game.rules import RuleBook
from shared.telemetry.live import HEART_PATH
from tests.unit.recorder.fencing import ONLY_FILE, Fencing

EN_GARDE = np.zeros((2, 13))
EN_GARDE[:, 3] = 1.0
EN_GARDE[0, 1], EN_GARDE[1, 1] = 2.0, -2.0
BEGAN_AT = 1_700_000_000.0
QUIET = replace(ONLY_FILE, heart_between_bouts=False)


def rows_of(path: Path, column: str, entity: str = "") -> list[tuple[float, Any]]:
    """Return wall time (s since the begin) and value of every row of a column, in order."""
    found: list[tuple[float, Any]] = []
    for chunk in RrdReader(path).stream():
        batch = chunk.to_record_batch()
        if chunk.is_static or column not in batch.schema.names:
            continue
        if entity and chunk.entity_path != f"/{entity}":
            continue
        times = batch.column("wall_time").cast("int64").to_pylist()
        values = batch.column(column).to_pylist()
        found += [(1e-9 * at - BEGAN_AT, value) for at, value in zip(times, values, strict=True)]
    return sorted(found, key=lambda row: row[0])


def test_the_score_of_a_bout_that_is_not_recorded_is_not_in_the_recording(tmp_path: Path):
    fencing = Fencing(tmp_path, ONLY_FILE, rules=RuleBook(bout_steps=50))
    with capture_logs() as log:
        for name in ("warm-up-1-a1", "s1-g01-a1"):
            fencing.start(name, EN_GARDE, is_recorded=name == "s1-g01-a1")
            fencing.rest(EN_GARDE, 150)
    fencing.recorder.close()
    judged = {line["bout"]: line["score"] for line in log if line["event"] == "bout_finished"}
    assert judged == {"warm-up-1-a1": None, "s1-g01-a1": 0.0}
    said = [value[0] for _, value in rows_of(tmp_path / "recording.rrd", "TextLog:text")]
    assert [text for text in said if "warm-up-1-a1: finished" in text] == [
        "bout warm-up-1-a1: finished"
    ]
    (counted,) = [text for text in said if "s1-g01-a1: finished" in text]
    assert counted == "bout s1-g01-a1: finished after 50 steps, score +0"
    scores = rows_of(tmp_path / "recording.rrd", "Scalars:scalars", "bout/score")
    assert scores
    assert scores[0][0] > 1.5


@pytest.mark.parametrize("is_kept", [True, False])
def test_the_heart_between_bouts_is_in_the_recording_where_it_is_wanted(
    tmp_path: Path, is_kept: bool
):
    cfg = ONLY_FILE if is_kept else QUIET
    fencing = Fencing(tmp_path, cfg, rules=RuleBook(bout_steps=200))
    fencing.rest(EN_GARDE, 500)
    fencing.start("s1-g01-a1", EN_GARDE)
    fencing.rest(EN_GARDE, 800)
    fencing.recorder.close()
    beats = [at for at, _ in rows_of(tmp_path / "recording.rrd", "Scalars:scalars", HEART_PATH)]
    assert [at for at in beats if 5.0 < at < 7.0]
    around = [at for at in beats if at < 3.5 or at > 8.5]
    assert bool(around) == is_kept
