import io
import json
from pathlib import Path

import structlog

from shared.runtime import logging
from shared.runtime.logging import configure_logging


def lines(path: Path) -> list[dict[str, object]]:
    return [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]


def test_an_event_is_a_json_line_with_what_the_process_bound(tmp_path: Path):
    path = tmp_path / "logs" / "actor-0.jsonl"
    configure_logging(path, console=io.StringIO(), bound={"service": "actor-0", "run_id": "r"})
    structlog.get_logger().info("rollout_published", policy_version=12)
    (event,) = lines(path)
    assert event["event"] == "rollout_published"
    assert (event["service"], event["run_id"], event["policy_version"]) == ("actor-0", "r", 12)
    assert str(event["timestamp"]).endswith("Z")


def test_a_console_nobody_looks_at_gets_warnings_only():
    console = io.StringIO()
    configure_logging(None, console=console, bound={"service": "league"})
    structlog.get_logger().info("lease_granted")
    structlog.get_logger().warning("rollout_refused", reason="stale")
    assert console.getvalue().endswith("league: rollout_refused reason=stale\n")
    assert "lease_granted" not in console.getvalue()


def test_a_traceback_goes_to_the_file_and_its_last_line_to_the_console(tmp_path: Path):
    console = io.StringIO()
    configure_logging(tmp_path / "x.jsonl", console=console)
    try:
        raise KeyError("nothing")
    except KeyError:
        structlog.get_logger().critical("service_crashed", exc_info=True)
    assert "Traceback" in str(lines(tmp_path / "x.jsonl")[0]["exception"])
    assert console.getvalue().rstrip().endswith("(KeyError: 'nothing')")


def test_a_full_log_file_is_set_aside_and_one_is_kept(tmp_path: Path, monkeypatch):
    monkeypatch.setattr(logging, "MAX_BYTES", 300)
    path = tmp_path / "x.jsonl"
    configure_logging(path, console=io.StringIO())
    for number in range(20):
        structlog.get_logger().info("something_happened", number=number)
    assert sorted(file.name for file in tmp_path.iterdir()) == ["x.jsonl", "x.jsonl.1"]
    assert path.stat().st_size <= 300 + 200
    assert lines(tmp_path / "x.jsonl.1")


def test_a_disk_without_space_loses_the_line_but_not_the_service(tmp_path: Path):
    path = tmp_path / "full"
    path.symlink_to("/dev/full")
    configure_logging(path, console=io.StringIO())
    structlog.get_logger().info("something_happened")
