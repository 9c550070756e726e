"""Which run an actor joins, and how long it waits for one: a real bus on this machine."""

import contextlib
import json
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

from services.actor import joining
from services.jobs import status
from shared.bus.config import BusConfig
from shared.bus.ports import free_port
from shared.bus.routing import open_router
from shared.bus.zenoh import open_zenoh
from shared.clock import SystemClock
from shared.errors import ConfigError
from shared.messages.league import Schedule
from shared.messages.live import ServiceStatus
from shared.messages.topics import SCHEDULE, STATUS

pytestmark = pytest.mark.zenoh


@pytest.fixture
def endpoint() -> Iterator[str]:
    """Return the bus of two runs, whose leagues say every second where they stand."""
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    over = threading.Event()
    with contextlib.ExitStack() as stack:
        stack.enter_context(contextlib.closing(open_router(BusConfig(listen=(endpoint,)))))
        cfg = BusConfig(connect=(endpoint,))
        leagues = [open_zenoh(cfg, "league-0", SystemClock(), run) for run in ("one", "two")]
        for league in leagues:
            stack.enter_context(contextlib.closing(league))
            league.publish(SCHEDULE, Schedule(stage=None, versions={}))
            said = ServiceStatus(
                role="league", name="league-0", boot=league.boot, pid=1, host="h", state="up"
            )
            league.publish(STATUS, said, role="league", name="league-0")

        def serve() -> None:
            while not over.is_set():
                for league in leagues:
                    league.wait(0.05)

        thread = threading.Thread(target=serve)
        thread.start()
        yield endpoint
        over.set()
        thread.join(10.0)


@pytest.mark.slow
def test_a_router_is_in_the_status_of_every_run_that_it_carries(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    words = ("--name", "router-7", "--run", str(tmp_path), "--run-id", "its-own")
    router = subprocess.Popen(
        [sys.executable, "-m", "services.router", *words, "--listen", endpoint]
    )
    try:
        with contextlib.ExitStack() as stack:
            cfg = BusConfig(connect=(endpoint,), open_seconds=60.0)
            for run in ("one", "two"):
                bus = open_zenoh(cfg, "actor-0", SystemClock(), run)
                stack.enter_context(contextlib.closing(bus)).declare_alive("actor")
            for run in ("one", "two"):
                assert status.main(["--connect", endpoint, "--run-id", run, "--json"]) == 0
                printed = capsys.readouterr().out.splitlines()[-1]  # its log stands before
                (said,) = json.loads(printed)["services"]
                assert (said["role"], said["name"]) == ("router", "router-7")
                assert said["counters"]["sessions"] == 3
        # A run of which nobody is left is none, and a router alone makes none.
        assert status.main(["--connect", endpoint, "--run-id", "its-own", "--json"]) == 1
    finally:
        router.terminate()
        assert router.wait(30) == 0


def test_of_several_runs_none_is_guessed(
    endpoint: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
):
    for module in (joining, status):
        monkeypatch.setattr(module, "LISTEN_SECONDS", 1.3)
    with pytest.raises(ConfigError, match=r"2 runs are on at .*: one, two; .*--run-id one"):
        joining.join(["--connect", endpoint], SystemClock())
    with pytest.raises(ConfigError, match=r"2 runs are on at .*: one, two; .*--run-id one"):
        status.main(["--connect", endpoint])
    assert status.main(["--connect", endpoint, "--run-id", "two"]) == 0
    assert "league-0" in capsys.readouterr().out
