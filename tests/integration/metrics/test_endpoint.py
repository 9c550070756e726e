"""The endpoint as a process: real router, real bus, real HTTP, Prometheus' own reader."""

import json
import os
import socket
import subprocess
import sys
import time
import urllib.error
import urllib.request
from collections.abc import Iterator
from pathlib import Path

import pytest

from services.metrics.families import FAMILIES
from shared.bus.config import BusConfig
from shared.bus.ports import free_port
from shared.bus.zenoh import open_zenoh
from shared.clock import SystemClock
from shared.messages.topics import PROGRESS, STATUS
from tests.unit.metrics.test_exposition import read
from tests.unit.metrics.test_service import LEARNER, PROGRESS_NOW

pytestmark = pytest.mark.zenoh
ROOT = Path(__file__).resolve().parents[3]


class Site:
    """A router and an endpoint."""

    def __init__(self, folder: Path) -> None:
        self.endpoint = f"tcp/127.0.0.1:{free_port()}"
        self.port = free_port()
        self.systemd = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self.systemd.bind(str(folder / "notify"))
        self.systemd.settimeout(30.0)
        run = ("--run", str(folder), "--run-id", "r1")
        self._router = self._start("router", *run, "--listen", self.endpoint)
        settings = ("--set", f"metrics.port={self.port}", "--set", "bus.open_seconds=60")
        watched = {"NOTIFY_SOCKET": str(folder / "notify")}
        self.metrics = self._start(
            "metrics", *run, "--connect", self.endpoint, *settings, **watched
        )

    def _start(self, module: str, *words: str, **environment: str) -> "subprocess.Popen[bytes]":
        return subprocess.Popen(
            [sys.executable, "-m", f"services.{module}", *words], cwd=ROOT,
            env={**os.environ, **environment},
        )  # fmt: skip

    def get(self, path: str) -> tuple[int, bytes]:
        try:
            with urllib.request.urlopen(f"http://127.0.0.1:{self.port}{path}", timeout=10) as got:
                return got.status, got.read()
        except urllib.error.HTTPError as error:
            return error.code, error.read()

    def close(self) -> None:
        for process in (self.metrics, self._router):
            process.kill()
            process.wait()
        self.systemd.close()


@pytest.fixture
def site(tmp_path: Path) -> Iterator[Site]:
    made = Site(tmp_path)
    yield made
    made.close()


def test_prometheus_reads_every_metric_of_a_run_and_floods_change_nothing(
    site: Site, tmp_path: Path
):
    cfg = BusConfig(connect=(site.endpoint,), open_seconds=60.0)
    bus = open_zenoh(cfg, "learner-0", SystemClock(), "r1")
    bus.publish(STATUS, LEARNER, role="learner", name="learner-antagonist")
    bus.publish(PROGRESS, PROGRESS_NOW)
    shown: dict[tuple[str, tuple[tuple[str, str], ...]], float] = {}
    deadline = time.monotonic() + 60.0
    while {name for name, _ in shown} != {family.name for family in FAMILIES}:
        assert time.monotonic() < deadline, f"only {sorted({name for name, _ in shown})}"
        bus.wait(0.1)
        try:
            status, page = site.get("/metrics")
        except OSError:  # it does not listen yet
            continue
        assert status == 200
        shown = read(page)
    bus.close()
    who = (("name", "learner-antagonist"), ("role", "learner"))
    assert shown["riposte_learner_starved_seconds_total", who] == 4.5
    own = (("name", "metrics-0"), ("role", "metrics"))
    assert shown["riposte_service_memory_bytes", own] > 1e6

    assert site.get("/healthz") == (200, b"ok\n")
    assert site.systemd.recv(100).startswith(b"READY=1\n")
    assert site.systemd.recv(100) == b"WATCHDOG=1"
    alive = [ROOT / "deploy/docker/riposte-alive", tmp_path, "30"]
    assert subprocess.run(alive, timeout=30, check=False).returncode == 0
    assert site.get("/../etc/passwd")[0] == 404
    for words in (b"POST /metrics HTTP/1.1\r\n\r\n", b"\0\xff\r\n\r\n", b"A" * 100_000):
        with socket.create_connection(("127.0.0.1", site.port), timeout=20) as client:
            client.sendall(words)
            answer = client.recv(200) if words.endswith(b"\r\n\r\n") else b"HTTP/1.1 400"
        assert answer.startswith((b"HTTP/1.1 405", b"HTTP/1.1 400"))
    assert site.get("/healthz") == (200, b"ok\n")

    site.metrics.terminate()
    assert site.metrics.wait(30) == 0
    logged = (tmp_path / "logs/metrics-0.jsonl").read_text().splitlines()
    assert any(json.loads(line)["event"] == "metrics_served" for line in logged)


def test_a_port_that_is_taken_ends_the_process_with_one_line(tmp_path: Path):
    clock = SystemClock()
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    run = ("--run", str(tmp_path), "--run-id", "r1")
    command = (sys.executable, "-m")
    router = subprocess.Popen([*command, "services.router", *run, "--listen", endpoint], cwd=ROOT)
    until = clock.now() + 60.0
    try:
        with socket.create_server(("127.0.0.1", 0)) as taken:
            port = taken.getsockname()[1]
            done = subprocess.run(
                [*command, "services.metrics", *run, "--connect", endpoint, "--set",
                 f"metrics.port={port}", "--set", "bus.open_seconds=60"],
                cwd=ROOT, capture_output=True, text=True, timeout=until - clock.now(), check=False,
                env={**os.environ, "PYTHONWARNINGS": "default"},
            )  # fmt: skip
    finally:
        router.kill()
        router.wait()
    assert done.returncode == 2
    assert done.stderr.splitlines()[-1].startswith(
        f"metrics-0: cannot serve metrics on 127.0.0.1:{port} ("
    )
