import json
import signal
from collections.abc import Callable
from pathlib import Path

import msgspec
import pytest

from shared.bus.memory import MemoryBus, MemoryHub
from shared.clock import ManualClock, SystemClock
from shared.errors import BusError, ConfigError
from shared.messages.topics import STATUS
from shared.runtime.process import usage
from shared.runtime.serve import parse_args, run_id_of, serve
from shared.runtime.service import Health, StatusReporter


class Scripted:
    """Does one thing each tick, then asks to be stopped as an operator would."""

    def __init__(self, *steps: Callable[[], object]) -> None:
        self.steps = [*steps, lambda: signal.raise_signal(signal.SIGTERM)]
        self.closed = 0

    def tick(self) -> bool:
        if self.steps:
            self.steps.pop(0)()
        return True

    def health(self) -> Health:
        return Health("fencing", waiting_for="league", counters={"ticks": 3}, last_error="none")

    def close(self) -> None:
        self.closed += 1


class Stage:
    """A bus in memory, a folder, and what a served process left behind."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.hub = MemoryHub(SystemClock())
        self.watcher = self.hub.join("watcher")
        self.statuses = self.watcher.subscribe(STATUS)
        self.bus: MemoryBus | None = None

    def serve(self, build: Callable[..., object], *flags: str) -> int:
        def open_bus(args, _clock):
            self.bus = self.hub.join(args.name)
            return self.bus

        argv = ["--name", "actor-7", "--run", str(self.folder / "a run"), *flags]
        return serve("actor", build, argv, open_bus=open_bus)

    def events(self) -> list[dict[str, object]]:
        path = self.folder / "a run" / "logs" / "actor-7.jsonl"
        return [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]


@pytest.fixture
def stage(tmp_path: Path) -> Stage:
    return Stage(tmp_path)


def test_a_service_ticks_reports_itself_and_is_closed_when_told_to_stop(stage: Stage):
    service = Scripted(lambda: None)
    assert stage.serve(lambda args, bus, clock: service) == 0
    assert service.closed == 1
    status = stage.statuses.take()
    assert status is not None
    assert (status.role, status.name, status.state) == ("actor", "actor-7", "fencing")
    assert (status.waiting_for, status.counters["ticks"]) == ("league", 3)
    assert any(name.startswith("bus_") for name in status.counters)
    assert status.rss_bytes > 1 << 20
    assert status.cpu_seconds > 0
    assert [event["event"] for event in stage.events()] == ["service_started", "service_stopped"]
    assert stage.events()[0]["run_id"] == "a-run"


def test_the_handlers_of_the_process_are_put_back(stage: Stage):
    before = signal.getsignal(signal.SIGTERM)
    stage.serve(lambda args, bus, clock: Scripted())
    assert signal.getsignal(signal.SIGTERM) is before


def raising(error: Exception) -> Callable[[], object]:
    def raise_it() -> None:
        raise error

    return raise_it


@pytest.mark.parametrize(
    ("error", "code", "event", "line"),
    [
        (ConfigError("num_envs is odd"), 2, "service_refused", "actor-7: num_envs is odd\n"),
        (BusError("the router is gone"), 75, "bus_lost", "actor-7: the router is gone\n"),
        (KeyError("oops"), 70, "service_crashed", "actor-7: bug: KeyError: 'oops' (traceback in "),
    ],
)
def test_what_ends_a_service_is_one_line_a_log_event_and_an_exit_code(
    stage: Stage, capsys, error: Exception, code: int, event: str, line: str
):
    service = Scripted(raising(error))
    assert stage.serve(lambda args, bus, clock: service) == code
    assert service.closed == 1
    assert capsys.readouterr().err.splitlines()[-1].startswith(line.strip())
    last = stage.events()[-1]
    assert last["event"] == event
    assert ("Traceback" in str(last.get("exception"))) == (code == 70)


def test_a_service_that_cannot_be_built_is_bad_input_and_leaves_the_bus(stage: Stage):
    assert stage.serve(lambda args, bus, clock: raising(ConfigError("no"))()) == 2
    assert stage.watcher.alive("actor") == frozenset()


def test_a_run_folder_that_is_a_file_is_named(stage: Stage, capsys):
    (stage.folder / "a run").write_text("", encoding="utf-8")
    assert stage.serve(lambda args, bus, clock: Scripted()) == 2
    assert "cannot write" in capsys.readouterr().err


class Section(msgspec.Struct, forbid_unknown_fields=True):
    num_envs: int = 1
    seed: int = 0


def test_sections_come_from_the_site_file_and_the_flags(tmp_path: Path):
    site = tmp_path / "site.toml"
    site.write_text("[actor]\nnum_envs = 4\nseed = 5\n", encoding="utf-8")
    argv = [str(site), "--agent", "antagonist", "--set", "actor.seed=9", "--connect", "tcp/a:1"]
    args = parse_args("actor", argv)
    assert args.section("actor", Section) == Section(4, 9)
    assert (args.name, args.agent, args.connect) == ("actor-0", "antagonist", ("tcp/a:1",))


def test_a_run_is_named_after_its_folder_in_letters_a_key_may_have(tmp_path: Path):
    assert run_id_of(tmp_path / "my run*2" / ".." / "my run*2") == "my-run-2"


def test_a_status_goes_out_once_a_second():
    clock = ManualClock()
    hub = MemoryHub(clock)
    statuses = hub.join("watcher").subscribe(STATUS)
    reporter = StatusReporter(Scripted(), hub.join("a"), clock, "actor")
    seen = 0
    for _ in range(25):
        reporter.tick()
        seen += statuses.take() is not None
        clock.advance(0.1)
    assert seen == 3
    assert reporter.status(usage()).state == "fencing"
