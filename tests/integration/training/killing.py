"""kill -9 for the processes of a run, and what must hold afterwards all the same."""

import contextlib
import json
import os
import signal
import subprocess
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from services.league.events import BoutsPlayed, VersionEntered
from services.league.ledger import open_read_only
from shared.errors import ConfigError, LedgerError
from tests.integration.training.training import log_of, state_of, wait_until

IN_TURN = "learner-in-turn"


def pid_of(folder: Path, name: str) -> int | None:
    """Return the id of a process of the run, None while it is down."""
    pid: int | None = None
    for event in log_of(folder, "train"):
        if event.get("process") == name:
            pid = event["pid"] if event["event"] != "process_died" else None
    return pid


def learner_in_turn(folder: Path) -> str | None:
    """Return the name of the learner whose stage it is."""
    with contextlib.suppress(ConfigError, LedgerError):
        record = state_of(folder).stage
        return f"learner-{record.stage.agent}" if record is not None else None
    return None


def progress_of(folder: Path) -> int:
    """Return how many updates have been made and evaluation bouts played."""
    with contextlib.suppress(ConfigError, LedgerError):  # not there yet, or just being made
        state = state_of(folder)
        return sum(record.updates for record in state.stages) + state.evaluation_done
    return 0


def kill_in_turn(
    folder: Path,
    process: "subprocess.Popen[str]",
    victims: Sequence[str],
    generator: np.random.Generator,
    *,
    longest_pause: float,
) -> list[str]:
    """Kill one process after the other, each at a random moment after the run has gone on.

    Returns:
        The names of those killed; fewer than asked for when the run was over first.
    """
    killed: list[str] = []
    done = 0
    for victim in victims:
        wait_until(lambda done=done: progress_of(folder) > done, process, 120)
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(generator.uniform(0.0, longest_pause))
        name = learner_in_turn(folder) if victim == IN_TURN else victim
        if name is None or process.poll() is not None:
            break
        pid = wait_until(lambda name=name: pid_of(folder, name), process)
        done = progress_of(folder)
        with contextlib.suppress(ProcessLookupError):
            os.kill(pid, signal.SIGKILL)
            killed.append(name)
    return killed


def assert_nothing_lost_nor_counted_twice(folder: Path) -> None:
    """Compare what the actors were told with what the ledger holds."""
    with open_read_only(folder / "league.sqlite") as ledger:
        events = [entry.event for entry in ledger.replay()]
    rollouts = Counter(
        name for event in events if isinstance(event, VersionEntered) for name in event.rollouts
    )
    results = Counter(event.name for event in events if isinstance(event, BoutsPlayed))
    told = [
        event for path in folder.glob("logs/actor-*.jsonl") for event in log_of(folder, path.stem)
    ]
    rollouts_told = {e["name"] for e in told if e["event"] == "rollout_acknowledged"}
    results_told = {e["name"] for e in told if e["event"] == "results_acknowledged"}
    assert rollouts_told
    assert results_told
    assert {name for name in rollouts_told if rollouts[name] != 1} == set()
    assert {name: count for name, count in rollouts.items() if count != 1} == {}
    assert {name for name in results_told if results[name] != 1} == set()
    state = state_of(folder)
    assert state.repeated_rollouts == 0
    assert state.finished
    assert state.evaluation_done == state.evaluation_total > 0
    for record in state.evaluations.values():
        assert all(record.played)
        assert record.done == record.planned


def assert_report_lists(folder: Path, killed: Sequence[str]) -> None:
    """Every kill stands in the ledger, and what stands there is reported."""
    incidents = state_of(folder).incidents
    for what in ("process_died", "process_restarted"):
        listed = Counter(i.detail.split()[0] for i in incidents if i.what == what)
        assert not Counter(killed) - listed, (what, killed, listed)
    summary = json.loads((folder / "summary.json").read_bytes())
    counts = summary["incident_counts"]
    assert counts["process_died"] >= len(killed)
    assert counts["process_restarted"] >= len(killed)
    page = (folder / "report.html").read_text()
    for name in killed:
        assert f"{name} died (killed by SIGKILL)" in page
