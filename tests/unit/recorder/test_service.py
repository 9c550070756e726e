from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import rerun as rr
from rerun.chunk import RrdReader

from services.recorder.config import RecorderConfig
from services.recorder.service import Recorder, recording_id
from shared.bus.memory import MemoryBus, MemoryHub
from shared.clock import ManualClock
from shared.messages.league import Schedule, Stage
from shared.messages.live import Progress, ServiceStatus
from shared.messages.topics import FRAMES, PROGRESS, SCHEDULE, STATUS
from shared.sim.config import SimConfig
from shared.sim.model import FencingModel
from tests.unit.recorder.bouts import frames

MODEL = FencingModel.build(SimConfig())
ONLY_FILE = RecorderConfig(live=False, bout_steps=200, min_free_mib=0)


@pytest.fixture(autouse=True)
def strict() -> Iterator[None]:
    """Let Rerun raise where it would only warn."""
    before = rr.strict_mode()
    rr.set_strict_mode(True)
    yield
    rr.set_strict_mode(before)


class Stand:
    """A recorder with somebody who talks to it."""

    def __init__(self, folder: Path, cfg: RecorderConfig = ONLY_FILE) -> None:
        self.clock = ManualClock(1_700_000_000.0)
        hub = MemoryHub(self.clock)
        self.bus: MemoryBus = hub.join("speaker")
        self.recorder = Recorder(cfg, hub.join("recorder-0"), self.clock, folder, MODEL)

    def run(self, seconds: float) -> None:
        for _ in range(round(seconds / 0.05)):
            self.recorder.tick()
            self.clock.advance(0.05)

    def progress(self, stage: int, update: int, **changes: Any) -> None:
        agent = ("antagonist", "protagonist")[stage % 2]
        fields: dict[str, Any] = {
            "run": "r", "stage": stage, "stages": 4, "phase": "one", "iteration": 1,
            "agent": agent, "update": update, "max_updates": 100,
            "total_samples": 20480 * update, "score_mean": 100.0 * update, "score_low": 0.0,
            "score_high": 200.0, "score_bouts": 12, "approx_kl": 0.01,
        }  # fmt: skip
        self.bus.publish(PROGRESS, Progress(**(fields | changes)))

    def status(self, boot: str = "b1", **changes: Any) -> None:
        fields: dict[str, Any] = {
            "role": "actor", "name": "actor-0", "boot": boot, "pid": 7, "host": "h",
            "state": "playing", "rss_bytes": 150 << 20, "rates": {"steps_per_s": 60000.0},
        }  # fmt: skip
        self.bus.publish(STATUS, ServiceStatus(**(fields | changes)), role="actor", name="actor-0")


def rows(path: Path) -> dict[str, int]:
    """Return how many rows each entity has that are not static."""
    found: dict[str, int] = defaultdict(int)
    for chunk in RrdReader(path).stream():
        if not chunk.is_static:
            found[chunk.entity_path] += chunk.num_rows
    return found


def texts(path: Path, entity: str) -> list[str]:
    found: list[str] = []
    for chunk in RrdReader(path).stream():
        if chunk.entity_path.startswith(entity) and not chunk.is_static:
            batch = chunk.to_record_batch()
            found += [text[0] for text in batch.column("TextLog:text").to_pylist()]
    return found


def test_a_bout_is_recorded_on_all_its_timelines(tmp_path: Path) -> None:
    stand = Stand(tmp_path)
    for first in range(4, 200, 40):
        stand.bus.publish(
            FRAMES, frames(MODEL, list(range(first, min(first + 40, 201), 4))), name="actor-0"
        )

    stand.run(4.0)
    stand.recorder.close()

    found = rows(tmp_path / "recording.rrd")
    movers = len(MODEL.body_names) - 3  # neither the world nor the torsos
    assert found["/bout/score"] == 50
    assert 50 * movers < found["/bout/scene/poses"] < 50 * movers + 50
    assert found["/bout/antagonist/joint/elbow_flex/position"] == 25
    assert found["/bout/scene/target"] == 2  # free, then the antagonist's bat is inside
    for chunk in RrdReader(tmp_path / "recording.rrd").stream():
        if chunk.entity_path == "/bout/score" and not chunk.is_static:
            assert set(chunk.timeline_names) == {"control_step", "bout_time", "wall_time"}


def test_every_shape_is_logged_once(tmp_path: Path) -> None:
    stand = Stand(tmp_path)
    stand.recorder.close()

    static = {c.entity_path for c in RrdReader(tmp_path / "recording.rrd").stream() if c.is_static}
    shapes = [path for path in static if path.startswith("/bout/scene/")]
    assert "/bout/scene/antagonist/wrist_roll/bat" in shapes
    assert "/bout/scene/target" in shapes
    assert len(shapes) == len(MODEL.shapes)


def test_curves_and_events_of_training_are_recorded(tmp_path: Path) -> None:
    stand = Stand(tmp_path)
    for update in range(1, 6):
        stand.progress(0, update, message="antagonist started to learn" if update > 2 else "")
        stand.status(boot="b1" if update < 4 else "b2", last_error="" if update < 5 else "oh dear")
        stand.run(5.0)
    stage = Stage(
        index=1, phase="one", iteration=1, agent="protagonist", opponent="sha256:" + "cd" * 32,
        max_updates=100, score_weight=1.0, shaping_weight=0.0,
    )  # fmt: skip
    stand.bus.publish(SCHEDULE, Schedule(stage=stage, versions={"antagonist": 5}))
    stand.progress(1, 1)
    stand.run(1.0)
    stand.recorder.close()

    path = tmp_path / "recording.rrd"
    found = rows(path)
    assert found["/training/score/antagonist"] == 5 + 1  # and the end of the curve
    assert found["/training/score/protagonist"] == 1
    assert found["/training/approx_kl/antagonist"] == 5 + 1
    assert found["/league/version/antagonist"] == 1
    assert found["/services/rss_mib/actor-0"] == 5
    assert found["/services/rate/actor-0/steps_per_s"] == 5
    said = texts(path, "/log")
    assert said.count("antagonist started to learn") == 1
    assert "actor-0 came back as a new process (pid 7)" in said
    assert "actor-0: oh dear" in said
    assert any(text.startswith("stage 2: protagonist learns against cdcdcdcd") for text in said)


def test_frames_of_another_model_are_refused_and_said_so(tmp_path: Path) -> None:
    stand = Stand(tmp_path)
    stand.bus.publish(FRAMES, frames(MODEL, [4, 8], model_hash="f" * 64), name="actor-0")
    stand.bus.publish(FRAMES, frames(MODEL, [4, 8], bodies=3), name="actor-0")

    stand.run(1.0)

    health = stand.recorder.health()
    assert health.counters["frames_refused"] == 4
    assert "give the recorder and the actors one [sim] section" in health.last_error
    stand.recorder.close()


def test_a_restarted_recorder_appends_a_file_of_the_same_recording(tmp_path: Path) -> None:
    for _ in range(2):
        stand = Stand(tmp_path)
        stand.progress(0, 1)
        stand.run(1.0)
        stand.recorder.close()

    names = sorted(path.name for path in tmp_path.glob("*.rrd"))
    assert names == ["recording-1.rrd", "recording.rrd"]
    identities = {entry.recording_id for name in names for entry in stores(tmp_path / name)}
    assert identities == {recording_id(tmp_path)}


def stores(path: Path) -> list[Any]:
    return list(RrdReader(path).recordings())


@pytest.mark.filterwarnings("ignore:RRD file has no footer")
def test_a_full_disk_ends_the_file_and_not_the_recorder(tmp_path: Path) -> None:
    stand = Stand(tmp_path, RecorderConfig(live=False, min_free_mib=1 << 20))

    stand.run(12.0)

    health = stand.recorder.health()
    assert health.state == "recording: nothing"
    assert "recording.rrd ended early" in health.last_error
    assert "MiB are kept free" in health.last_error
    stand.progress(0, 1)
    stand.run(1.0)
    stand.recorder.close()
    rows(tmp_path / "recording.rrd")  # what was written is a whole file
