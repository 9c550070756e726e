import json
from pathlib import Path

import pytest

from services.jobs.doctor import command as doctor
from services.jobs.doctor import machine, software
from services.jobs.doctor.finding import Finding
from shared.bus.memory import MemoryHub
from shared.clock import SystemClock


def test_a_full_disk_and_a_folder_that_cannot_be_written_fail(tmp_path: Path, monkeypatch):
    assert machine.check_disk(tmp_path / "not" / "there").state in ("ok", "warn")
    monkeypatch.setattr(machine, "MIN_FREE_DISK", 1 << 60)
    finding = machine.check_disk(tmp_path)
    assert finding.state == "fail"
    assert "--out" in finding.advice
    assert machine.check_disk(Path("/proc/nowhere")).state == "fail"


def test_a_containers_quota_limits_the_cores(tmp_path: Path):
    path = tmp_path / "cpu.max"
    path.write_text("150000 100000\n", encoding="ascii")
    assert machine.cpu_quota(path) == 1.5
    path.write_text("max 100000\n", encoding="ascii")
    assert machine.cpu_quota(path) == float("inf")
    assert machine.cpu_quota(tmp_path / "none") == float("inf")


def test_round_trips_are_counted_as_they_are_answered():
    hub = MemoryHub(SystemClock())
    times = machine.round_trips(hub.join("a"), hub.join("b"), SystemClock(), 7)
    assert len(times) == 7
    assert all(0 <= seconds < 2 for seconds in times)


def test_pins_are_compared_with_what_is_installed(tmp_path: Path):
    path = tmp_path / "constraints.txt"
    path.write_text("# comment == 1\nnumpy==0.0.1\nnot-installed-at-all==3\n", encoding="utf-8")
    pinned = software.pins(path)
    assert pinned == {"numpy": "0.0.1", "not-installed-at-all": "3"}
    (wrong,) = software.differing(pinned)
    assert wrong.startswith("numpy ")
    assert wrong.endswith("(tested 0.0.1)")
    assert software.pins(tmp_path / "none") == {}


def test_a_probe_that_breaks_is_advice_not_a_traceback(tmp_path: Path, monkeypatch):
    monkeypatch.setattr(software, "DRAW", "raise RuntimeError('no EGL')")
    finding = software.check_pictures(tmp_path)
    assert finding.state == "warn"
    assert "RuntimeError: no EGL" in finding.detail
    assert "libegl1" in finding.advice


def test_this_installation_is_recognised():
    assert software.check_source().state == "ok"
    assert software.check_python().state == "ok"
    assert software.check_packages().state in ("ok", "warn")


@pytest.mark.parametrize(("state", "code"), [("ok", 0), ("warn", 0), ("fail", 1)])
def test_only_what_is_essential_fails_the_doctor(monkeypatch, capsys, state, code: int):
    found = [("heart", lambda: Finding(state, "beats", "rest"))]
    monkeypatch.setattr(doctor, "checks", lambda folder, is_quick: found)
    assert doctor.main(["--json"]) == code
    report = json.loads(capsys.readouterr().out)
    assert report["fit"] is (code == 0)
    assert report["checks"]["heart"] == {"state": state, "detail": "beats", "advice": "rest"}
    assert doctor.main([]) == code
    assert "→ rest" in capsys.readouterr().out
