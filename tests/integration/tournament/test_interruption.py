"""A tournament that is killed, interrupted, in use, or out of room goes on where it was."""

import contextlib
import os
import signal
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from services.jobs.runs import state_of
from shared.errors import ConfigError, LedgerError
from shared.styles.bouts import load
from tests.integration.disks import fill, small_disk
from tests.integration.tournament.playing import (
    ROOT,
    WORDS,
    a_run,
    assert_one_opponent_a_bout,
    command,
    riposte,
    tournament,
)
from tests.integration.training.training import living, one_line, processes_of, wait_until

pytestmark = [pytest.mark.zenoh, pytest.mark.timeout(300)]


def played(folder: Path) -> int:
    """Return how many bouts are in the ledger of a tournament."""
    with contextlib.suppress(ConfigError, LedgerError):  # not there yet, or just being made
        return state_of(folder).evaluation_done
    return 0


@contextlib.contextmanager
def playing(run: Path, *words: str) -> "Iterator[subprocess.Popen[str]]":
    """Start a tournament, and leave no process of it behind."""
    process = subprocess.Popen(
        command(run, *words), cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    try:
        yield process
    finally:
        process.kill()
        process.communicate()


def test_killed_with_its_actor_it_goes_on_and_plays_the_bouts_of_one_never_stopped(
    finished: Path, tmp_path: Path
):
    run = a_run(tmp_path / "run")
    folder = run / "tournament"
    with playing(run, *WORDS, "--actors", "1") as process:
        wait_until(lambda: played(folder) > 0, process, 120)
        actor = wait_until(lambda: living(folder, "actor-0"), process)
        os.kill(actor, signal.SIGKILL)
        before = played(folder)
        process.kill()
    assert 0 < before < 108
    summary = tournament(run, "--actors", "2")
    assert summary["bouts"] == 108
    assert_one_opponent_a_bout(state_of(folder))
    mine, its = (load(r / "tournament" / "bouts.parquet") for r in (run, finished))
    for name in ("antagonist", "protagonist", "bout", "seed", "score", "features"):
        assert getattr(mine, name).tobytes() == getattr(its, name).tobytes(), name


@pytest.mark.slow
def test_interrupted_it_stops_in_order_and_says_how_to_go_on(tmp_path: Path):
    run = a_run(tmp_path / "run")
    folder = run / "tournament"
    with playing(run, "--bouts", "3000", "--actors", "1") as process:
        wait_until(lambda: played(folder) > 0, process, 120)
        second = riposte(["tournament", str(run)])
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=100)
    assert (process.returncode, err) == (130, "")
    assert out.splitlines()[-1] == f"stopped; continue with: riposte tournament {run}"
    assert processes_of(folder) == []
    assert second.returncode == 2
    assert "is in use by process" in one_line(second.stderr)
    assert 0 < played(folder) < 4 * 3000
    ratings = riposte(["ratings", str(run)])  # of what has been played so far
    assert ratings.returncode == 0, ratings.stderr
    assert "antagonist 2" in ratings.stdout
    styles = riposte(["styles", str(run)])  # which need the whole of it
    assert styles.returncode == 2
    one_line(styles.stderr)


@pytest.fixture
def disk(tmp_path: Path) -> Iterator[Path]:
    """Little more room than a tournament asks for."""
    with small_disk(tmp_path, 72) as disk:
        yield disk


@pytest.mark.slow
def test_a_full_disk_ends_it_and_names_what_goes_on(disk: Path):
    run = a_run(disk / "run")
    folder, filler = run / "tournament", disk / "filler"
    with playing(run, "--bouts", "3000", "--actors", "1") as process:
        wait_until(lambda: played(folder) > 0, process, 120)
        fill(filler)
        _, err = process.communicate(timeout=100)
    assert process.returncode == 2, err
    text = one_line(err)
    assert "no space left" in text
    assert text.endswith(f"continue with: riposte tournament {run}")
    assert processes_of(folder) == []
    before = played(folder)
    refused = riposte(["tournament", str(run)])
    assert refused.returncode == 2
    assert "space" in one_line(refused.stderr)
    filler.unlink()
    assert played(folder) == before > 0
    with playing(run, "--actors", "1") as process:
        wait_until(lambda: played(folder) > before, process, 120)
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=100)
    assert process.returncode == 130
