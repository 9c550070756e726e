"""Which run an actor joins, and how long it waits for one: a real bus on this machine."""

import contextlib
import threading
from collections.abc import Iterator

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
