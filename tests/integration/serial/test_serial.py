import contextlib
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from services.jobs.runs import state_of
from services.jobs.settings import Settings
from services.jobs.train.serial import SerialRun
from services.league.events import RunStarted
from services.league.ledger import Ledger
from services.league.service import League
from shared.bus.memory import MemoryHub
from shared.clock import ManualClock
from shared.errors import CheckpointError, LedgerError
from tests.integration.serial.conftest import Uninterrupted
from tests.integration.serial.running import RUN, assert_same, remains, run
from tests.integration.small import SMALL

ROOT = Path(__file__).resolve().parents[3]


def cuts(folder: Path) -> list[Path]:
    return sorted((folder / "serial").glob("cut-*.safetensors"))


def flip_a_byte(path: Path) -> None:
    payload = bytearray(path.read_bytes())
    payload[-5] ^= 0xFF
    path.write_bytes(payload)


def test_a_run_goes_through_both_stages_and_the_evaluation(tmp_path: Path) -> None:
    run(tmp_path)
    state = state_of(tmp_path)
    assert state.finished
    assert state.serial
    assert [record.updates for record in state.stages] == [3, 3]
    assert state.evaluation_done == state.evaluation_total == 16
    assert state.repeated_rollouts == 0
    assert state.incidents == []


def test_the_same_seed_gives_the_same_bits(tmp_path: Path, uninterrupted: Uninterrupted) -> None:
    ticks = run(tmp_path)
    assert ticks == uninterrupted.ticks
    assert_same(remains(tmp_path), uninterrupted.remains)


def test_a_recorder_that_looks_on_changes_no_bit(
    tmp_path: Path, uninterrupted: Uninterrupted
) -> None:
    run(tmp_path, record=True)
    assert (tmp_path / "recording.rrd").stat().st_size > 0
    assert_same(remains(tmp_path), uninterrupted.remains)


def test_another_seed_gives_other_bits(tmp_path: Path, uninterrupted: Uninterrupted) -> None:
    run(tmp_path, overrides=("train.seed=1",))
    found = remains(tmp_path)
    assert not found.snapshots.keys() & uninterrupted.remains.snapshots.keys()


@pytest.mark.parametrize("draw", range(6))
def test_a_run_stopped_anywhere_resumes_to_the_bits_of_the_uninterrupted_one(
    tmp_path: Path, uninterrupted: Uninterrupted, draw: int
) -> None:
    generator = np.random.default_rng(draw)
    for _ in range(3):
        ticks = int(generator.integers(0, uninterrupted.ticks // 2))
        run(tmp_path, resume=(tmp_path / "league.sqlite").exists(), ticks=ticks)
    run(tmp_path, resume=True)
    assert_same(remains(tmp_path), uninterrupted.remains)


def test_a_run_resumed_from_each_of_its_cuts_gives_the_same_bits(
    tmp_path: Path, uninterrupted: Uninterrupted
) -> None:
    numbers = [0]
    for _ in range(200):
        run(
            tmp_path,
            resume=(tmp_path / "league.sqlite").exists(),
            look=lambda serial: numbers.append(_run_to_next_cut(serial)),
            ticks=0,
        )
        if state_of(tmp_path).finished:
            break
    assert numbers == sorted(set(numbers)), numbers
    assert_same(remains(tmp_path), uninterrupted.remains)


def _run_to_next_cut(serial: SerialRun) -> int:
    before = serial.cut_number
    while serial.cut_number == before and not serial.finished:
        serial.tick()
    return serial.cut_number


def test_a_finished_run_resumed_is_finished(tmp_path: Path, uninterrupted: Uninterrupted) -> None:
    run(tmp_path)
    assert run(tmp_path, resume=True) == 0
    assert_same(remains(tmp_path), uninterrupted.remains)


def test_a_run_killed_with_nine_resumes_to_the_same_bits(
    tmp_path: Path, uninterrupted: Uninterrupted
) -> None:
    folder = tmp_path / RUN
    generator = np.random.default_rng(0)
    command = [sys.executable, "-m", "services.cli", "train", "--serial", "--out", str(folder)]
    command += [word for override in SMALL for word in ("--set", override)]
    for attempt in range(2):
        words = [*command, *(["--resume"] if (folder / "league.sqlite").exists() else [])]
        process = subprocess.Popen(
            words, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
        )
        try:
            if attempt == 0:
                _await_growth(folder / "league.sqlite-wal", process)
                with contextlib.suppress(subprocess.TimeoutExpired):
                    process.wait(generator.uniform(0.0, 0.5))
                os.kill(process.pid, signal.SIGKILL)
                process.communicate(timeout=30)
            else:
                output, _ = process.communicate(timeout=90)
                assert process.returncode == 0, output
        finally:
            process.kill()
            process.communicate()
    assert_same(remains(folder), uninterrupted.remains)
    assert (folder / "report.html").exists()


def _await_growth(path: Path, process: "subprocess.Popen[str]") -> None:
    """Wait until a file is there and has grown once."""
    deadline = time.monotonic() + 60.0
    size = path.stat().st_size if path.exists() else 0
    while not path.exists() or path.stat().st_size <= size:
        assert process.poll() is None, process.communicate()[0]
        assert time.monotonic() < deadline
        time.sleep(0.005)


def test_a_damaged_newest_cut_gives_way_to_the_one_before(
    tmp_path: Path, uninterrupted: Uninterrupted
) -> None:
    run(tmp_path, ticks=uninterrupted.ticks // 2)
    flip_a_byte(cuts(tmp_path)[-1])
    run(tmp_path, resume=True)
    assert_same(remains(tmp_path), uninterrupted.remains)


def test_a_cut_cut_short_gives_way_to_the_one_before(
    tmp_path: Path, uninterrupted: Uninterrupted
) -> None:
    run(tmp_path, ticks=uninterrupted.ticks // 2)
    newest = cuts(tmp_path)[-1]
    newest.write_bytes(newest.read_bytes()[:100])
    run(tmp_path, resume=True)
    assert_same(remains(tmp_path), uninterrupted.remains)


def test_a_cut_whose_checkpoint_is_damaged_gives_way_to_the_one_before(
    tmp_path: Path, uninterrupted: Uninterrupted
) -> None:
    run(tmp_path, ticks=uninterrupted.ticks // 2)
    flip_a_byte(max((tmp_path / "learner").rglob("*.safetensors"), key=lambda p: p.stat().st_mtime))
    run(tmp_path, resume=True)
    assert_same(remains(tmp_path), uninterrupted.remains)


def test_without_a_usable_cut_a_run_does_not_resume(
    tmp_path: Path, uninterrupted: Uninterrupted
) -> None:
    run(tmp_path, ticks=uninterrupted.ticks // 2)
    before = remains(tmp_path)
    for path in cuts(tmp_path):
        flip_a_byte(path)
    with pytest.raises(CheckpointError, match=r"no usable cut in .*damaged.*--out") as caught:
        run(tmp_path, resume=True)
    assert "\n" not in str(caught.value)
    after = remains(tmp_path)
    assert (after.ledger, after.checkpoints) == (before.ledger, before.checkpoints)


def test_a_run_stopped_before_its_first_cut_starts_again(
    tmp_path: Path, uninterrupted: Uninterrupted
) -> None:
    run(tmp_path, ticks=2)
    assert not cuts(tmp_path)
    assert len(remains(tmp_path).ledger) > 1
    run(tmp_path, resume=True)
    assert_same(remains(tmp_path), uninterrupted.remains)


def test_cuts_of_another_run_are_refused(tmp_path: Path, uninterrupted: Uninterrupted) -> None:
    run(tmp_path, ticks=uninterrupted.ticks // 2)
    settings = Settings.load(None, SMALL)
    with pytest.raises(CheckpointError, match="belongs to run serial-run, not other"):
        SerialRun(settings, tmp_path, "other", resume=True, record=False)


def test_a_run_of_processes_is_not_resumed_serially(tmp_path: Path) -> None:
    settings = Settings.load(None, SMALL)
    with contextlib.closing(Ledger(tmp_path / "league.sqlite")) as ledger:
        ledger.append([RunStarted(run=RUN, seed=0, serial=False, config=settings.league)], 0)
    with pytest.raises(LedgerError, match=r"begun by processes; resume it without --serial"):
        run(tmp_path, resume=True)
    assert len(remains(tmp_path).ledger) == 1


def test_a_serial_run_is_not_resumed_by_processes(tmp_path: Path) -> None:
    run(tmp_path, ticks=3)
    clock = ManualClock()
    settings = Settings.load(None, SMALL)
    with pytest.raises(LedgerError, match=r"begun in one process; resume it with --serial"):
        League(
            settings.league, MemoryHub(clock).join("league-0"), clock, tmp_path, RUN, 0,
            serial=False,
        )  # fmt: skip
