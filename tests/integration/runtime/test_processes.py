import contextlib
import json
import socket
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from services import cli
from services.jobs.doctor import machine
from services.jobs.doctor.machine import check_bus
from services.jobs.status import main as status
from shared.bus.config import BusConfig
from shared.bus.ports import free_port
from shared.bus.routing import open_router
from shared.bus.zenoh import open_zenoh
from shared.clock import SystemClock
from shared.runtime.service import Health, run

pytestmark = pytest.mark.zenoh


class Idle:
    def tick(self) -> bool:
        return False

    def health(self) -> Health:
        return Health("waiting", waiting_for="league", waiting_seconds=2.0)

    def close(self) -> None:
        pass


@pytest.fixture
def endpoint():
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    with contextlib.closing(open_router(BusConfig(listen=(endpoint,)))):
        yield endpoint


def test_status_shows_a_service_it_finds_through_the_runs_folder(
    tmp_path: Path, endpoint: str, capsys
):
    stop = threading.Event()

    def serve() -> None:
        clock = SystemClock()
        cfg = BusConfig(connect=(endpoint,))
        with contextlib.closing(open_zenoh(cfg, "actor-0", clock, "demo")) as bus:
            run(Idle(), bus, clock, "actor", stop)

    thread = threading.Thread(target=serve)
    thread.start()
    try:
        (tmp_path / "endpoint.json").write_text(json.dumps({"connect": endpoint, "run": "demo"}))
        assert status(["--run", str(tmp_path), "--json"]) == 0
        (said,) = json.loads(capsys.readouterr().out)["services"]
        assert (said["name"], said["waiting_for"]) == ("actor-0", "league")
        assert status(["--connect", endpoint, "--run-id", "another"]) == 1
        assert "nobody answers" in capsys.readouterr().out
    finally:
        stop.set()
        thread.join(10)
    assert not thread.is_alive()


def test_a_port_in_use_is_named_with_what_it_is_for(monkeypatch):
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        assert not machine.is_port_free(port)
        monkeypatch.setattr(machine, "PORTS", {port: "the test"})
        finding = machine.check_ports()
    assert finding.state == "warn"
    assert f"{port}, the test" in finding.detail


def test_the_doctor_measures_the_bus():
    finding = check_bus()
    assert finding.state in ("ok", "warn"), finding
    assert "there and back" in finding.detail


@pytest.mark.parametrize("name", sorted(cli.COMMANDS))
def test_every_command_explains_itself(name: str, capsys):
    try:
        code = cli.main([name, "--help"])
    except SystemExit as left:  # as argparse does
        code = left.code
    assert code == 0
    assert f"riposte {name}" in capsys.readouterr().out


def test_a_service_without_a_bus_ends_with_the_code_for_start_me_again(tmp_path: Path):
    code = (
        "import sys; from shared.runtime.serve import serve; "
        "sys.exit(serve('actor', lambda *_: None))"
    )
    command = [
        sys.executable, "-P", "-c", code, "--run", str(tmp_path),
        "--connect", f"tcp/127.0.0.1:{free_port()}", "--set", "bus.open_seconds=0.2",
    ]  # fmt: skip
    done = subprocess.run(command, capture_output=True, text=True, timeout=60)
    assert done.returncode == 75, done.stderr
    assert done.stderr.splitlines()[-1].startswith("actor-0: no router at tcp/127.0.0.1:")


def test_up_starts_what_a_site_file_lists_and_stops_it_in_reverse(tmp_path: Path):
    site = tmp_path / "site.toml"
    site.write_text(
        f'[bus]\nlisten = ["tcp/127.0.0.1:{free_port()}"]\n'
        '[site]\nprocesses = ["router", "league"]\n',
        encoding="utf-8",
    )
    command = [sys.executable, "-P", "-m", "services.cli", "up", site, "--run", tmp_path / "run"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as up:
        assert up.stdout is not None
        started = [up.stdout.readline(), up.stdout.readline()]
        second = subprocess.run(command, capture_output=True, text=True, timeout=60)
        up.terminate()
        stopped = up.stdout.read().splitlines()
        assert up.wait(60) == 0
    assert started == ["router-0 started\n", "league-0 started\n"]
    assert [line.split(" ")[0] for line in stopped] == ["league-0", "router-0"]
    assert second.returncode == 2
    assert f"run is in use by process {up.pid}" in second.stderr
