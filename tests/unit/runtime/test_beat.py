"""What systemd and a container's health check see of a process."""

import os
import socket
from pathlib import Path

import pytest

from shared.runtime.beat import Beat


def test_the_time_of_the_log_moves_with_each_beat(tmp_path: Path):
    log = tmp_path / "actor-0.jsonl"
    log.write_text("{}\n")
    os.utime(log, (1.0, 1.0))
    Beat(log).tick()
    assert log.stat().st_mtime > 1e9
    assert log.read_text() == "{}\n"


def test_systemd_hears_that_the_process_is_ready_once_and_then_that_it_lives(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as systemd:
        systemd.bind(str(tmp_path / "notify"))
        systemd.settimeout(5.0)
        monkeypatch.setenv("NOTIFY_SOCKET", str(tmp_path / "notify"))
        beat = Beat()
        beat.tick()
        beat.tick()
        assert [systemd.recv(100), systemd.recv(100)] == [b"READY=1\nWATCHDOG=1", b"WATCHDOG=1"]


def test_nobody_listening_and_a_lost_file_stop_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setenv("NOTIFY_SOCKET", "@riposte-nobody-listens-here")
    Beat(tmp_path / "gone").tick()
    assert not (tmp_path / "gone").exists()
