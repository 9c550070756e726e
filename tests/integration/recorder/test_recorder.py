import contextlib
import socket
import subprocess
import sys
import urllib.request
from pathlib import Path

import pytest

from services.recorder.config import RecorderConfig
from services.recorder.service import Recorder
from shared.bus.memory import MemoryHub
from shared.clock import SystemClock
from shared.telemetry.door import read_live_view
from tests.unit.recorder.test_service import MODEL, Stand, rows

FAILING = """
import resource, signal, sys
from pathlib import Path
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
from tests.unit.recorder.test_service import Stand, MODEL, FRAMES, frames
stand = Stand(Path(sys.argv[1]))
limit = stand.recorder._recording.file_size + 80_000
resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))
for bout in range(6):
    stand.bus.publish(FRAMES, frames(MODEL, list(range(4, 201, 4)), bout), name="actor-0")
    stand.run(6.0)
print(stand.recorder.health().last_error)
stand.recorder.close()
"""


@pytest.mark.filterwarnings("ignore:RRD file has no footer")
def test_a_file_that_cannot_grow_is_given_up_and_readable(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-c", FAILING, str(tmp_path)], capture_output=True, text=True,
        timeout=60, check=True,
    )  # fmt: skip

    assert "recording.rrd ended early (File too large)" in done.stdout
    assert rows(tmp_path / "recording.rrd")["/bout/score"] > 0


KILLED = """
import sys
from pathlib import Path
from tests.unit.recorder.test_service import Stand, MODEL, FRAMES, frames
stand = Stand(Path(sys.argv[1]))
for bout in range(3):
    stand.bus.publish(FRAMES, frames(MODEL, list(range(4, 201, 4)), bout), name="actor-0")
    stand.run(6.0)
stand.recorder._recording.flush(5.0)
print("ready", flush=True)
sys.stdin.read()
"""


@pytest.mark.filterwarnings("ignore:RRD file has no footer")
def test_after_a_kill_the_file_is_readable_to_the_last_flush(tmp_path: Path) -> None:
    process = subprocess.Popen(
        [sys.executable, "-c", KILLED, str(tmp_path)],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
    )  # fmt: skip
    assert process.stdout is not None
    assert process.stdin is not None
    while (line := process.stdout.readline()) and line != "ready\n":
        pass
    process.kill()
    process.wait(10)
    process.stdin.close()
    process.stdout.close()

    Stand(tmp_path).recorder.close()

    assert rows(tmp_path / "recording.rrd")["/bout/score"] >= 100
    assert (tmp_path / "recording-1.rrd").exists()


def test_the_live_view_is_on_the_loopback_under_a_short_address(tmp_path: Path) -> None:
    clock = SystemClock()
    hub = MemoryHub(clock)
    cfg = RecorderConfig(file=False, web_port=0)
    recorder = Recorder(cfg, hub.join("recorder-0"), clock, tmp_path, MODEL)
    with contextlib.closing(recorder):
        view = read_live_view(tmp_path)
        assert view is not None
        assert view.url == recorder.url
        port = int(view.url.rsplit(":", 1)[1])
        with socket.create_connection(("127.0.0.1", port), timeout=5.0) as visitor:
            visitor.settimeout(5.0)
            visitor.sendall(b"GET / HTTP/1.1\r\n\r\n")
            recorder.tick()
            recorder.tick()
            assert view.page.encode() in visitor.recv(4096)
        assert recorder.health().state == "recording: live view"
        assert fetched(view.page, clock).startswith("<!doctype html>")
    assert read_live_view(tmp_path) is None


def fetched(url: str, clock: SystemClock) -> str:
    """Return a page that its server may take a while to serve."""
    until = clock.now() + 20.0
    while True:
        try:
            with urllib.request.urlopen(url, timeout=5.0) as answer:
                return answer.read().decode()
        except OSError:
            if clock.now() > until:
                raise
