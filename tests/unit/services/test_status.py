import json
from pathlib import Path

import pytest
from rich.console import Console

from services.jobs import status
from shared.bus.memory import MemoryHub
from shared.clock import SystemClock
from shared.errors import ConfigError
from shared.messages.live import Progress, ServiceStatus
from shared.messages.topics import PROGRESS, STATUS

ACTOR = ServiceStatus(
    role="actor", name="actor-0", boot="b", pid=1, host="h", state="playing",
    waiting_for="learner-antagonist", waiting_seconds=3.25, rates={"samples_per_s": 12345.6},
    counters={"bus_sent": 9, "rollouts_dropped": 2, "refused_messages": 0},
    rss_bytes=100 << 20, last_error="lease lapsed",
)  # fmt: skip
PROGRESS_NOW = Progress(
    run="demo", stage=1, stages=4, phase="one", iteration=1, agent="protagonist", update=3,
    max_updates=120, total_samples=1000, score_mean=1500.2, score_low=1400.0, score_high=1600.0,
    score_bouts=64, eta_seconds=125.0,
)  # fmt: skip


def test_what_services_say_is_gathered_and_shown_as_one_row_each():
    hub = MemoryHub(SystemClock())
    service = hub.join("actor-0")
    service.publish(STATUS, ACTOR, role="actor", name="actor-0")
    service.publish(PROGRESS, PROGRESS_NOW)
    snapshot = status.listen(hub.join("status"), SystemClock(), 0.02)
    assert snapshot == status.Snapshot(services=(ACTOR,), progress=PROGRESS_NOW)
    console = Console(width=160, record=True, quiet=False, file=None)
    with console.capture() as capture:
        console.print(status.table(snapshot))
    row = capture.get().splitlines()[1]
    for text in (
        "actor-0", "playing", "learner-antagonist for 3.2 s", "samples_per_s 12,346",
        "rollouts_dropped 2", "100 MiB", "lease lapsed",
    ):  # fmt: skip
        assert text in row
    assert "refused" not in row
    assert json.loads(json.dumps(status.to_json(snapshot)))["services"][0]["pid"] == 1


def test_the_headline_says_who_learns_and_how_long_it_takes():
    line = status.headline(PROGRESS_NOW)
    assert (
        "iteration 1, stage 2/4, protagonist learns, update 3/120, score 1500 [1400, 1600]" in line
    )
    assert line.endswith(", 2:05 left")


def test_a_run_is_found_through_its_folder(tmp_path: Path):
    (tmp_path / "endpoint.json").write_text('{"connect": "tcp/127.0.0.1:9", "run": "demo"}')
    assert status.read_endpoint(tmp_path) == status.Endpoint(connect="tcp/127.0.0.1:9", run="demo")


@pytest.mark.parametrize("text", [None, "not json", '{"connect": 7}'])
def test_a_folder_without_a_run_is_answered_in_one_line(tmp_path: Path, text: str | None):
    if text is not None:
        (tmp_path / "endpoint.json").write_text(text, encoding="utf-8")
    with pytest.raises(ConfigError, match=r"endpoint\.json is (missing|damaged)"):
        status.read_endpoint(tmp_path)
