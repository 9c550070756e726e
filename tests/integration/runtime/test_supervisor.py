import itertools
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import psutil
import pytest

from services import supervisor as module
from services.supervisor import ProcessEvent, ProcessSpec, Supervisor
from shared.clock import ManualClock, SystemClock

FOREVER = "import signal; print('up', flush=True); signal.pause()"
"""Until SIGTERM."""
STUBBORN = (
    "import signal; signal.signal(signal.SIGTERM, signal.SIG_IGN); print('up', flush=True)\n"
    "while True: signal.pause()"
)


def spec(name: str, code: str, **fields: object) -> ProcessSpec:
    return ProcessSpec(name, (sys.executable, "-S", "-c", code), **fields)


@pytest.fixture
def supervise(tmp_path: Path) -> Iterator[Callable[..., Supervisor]]:
    made: list[Supervisor] = []

    def make(*specs: ProcessSpec, clock: object = None) -> Supervisor:
        made.append(Supervisor(specs, tmp_path, clock or SystemClock()))
        return made[-1]

    yield make
    for each in made:
        each.stop()


def until(condition: Callable[[], object], seconds: float = 20.0) -> None:
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline, "did not happen in time"
        time.sleep(0.005)


def poll_until(supervisor: Supervisor, kind: str) -> list[ProcessEvent]:
    events: list[ProcessEvent] = []

    def happened() -> bool:
        events.extend(supervisor.poll())
        return any(event.kind == kind for event in events)

    until(happened)
    return events


def said(log_dir: Path, name: str, text: str) -> Callable[[], bool]:
    return lambda: text in (log_dir / f"{name}.out").read_text(encoding="utf-8")


def test_a_killed_process_is_started_again(supervise, tmp_path: Path):
    supervisor = supervise(spec("a", FOREVER), spec("b", FOREVER))
    assert [event.kind for event in supervisor.start()] == ["started", "started"]
    before = supervisor.pids
    os.kill(before["a"], signal.SIGKILL)
    events = poll_until(supervisor, "restarted")
    assert [(event.kind, event.name) for event in events] == [("died", "a"), ("restarted", "a")]
    assert events[0].exit_code == -signal.SIGKILL
    assert "killed by SIGKILL" in events[0].describe
    assert supervisor.restarts == {"a": 1, "b": 0}
    assert supervisor.pids["a"] != before["a"]
    assert supervisor.pids["b"] == before["b"]


def test_a_process_that_ends_well_is_finished_and_stays_so(supervise):
    supervisor = supervise(spec("job", "pass"))
    supervisor.start()
    events = poll_until(supervisor, "finished")
    assert [event.exit_code for event in events] == [0]
    assert supervisor.pids == {}
    assert supervisor.poll() == []


def test_a_service_that_somebody_else_told_to_end_is_started_again(supervise):
    supervisor = supervise(spec("a", FOREVER, finishes=False), spec("b", "pass", finishes=False))
    supervisor.start()
    died, restarted = poll_until(supervisor, "restarted")[:2]
    assert (died.kind, died.name, died.exit_code) == ("died", "b", 0)
    assert (restarted.kind, restarted.name) == ("restarted", "b")
    assert [event.kind for event in supervisor.stop()][-1] == "stopped"
    assert supervisor.poll() == []


def test_delays_double_and_hopeless_processes_are_given_up_with_the_end_of_their_log(supervise):
    clock = ManualClock()
    supervisor = supervise(spec("a", "raise RuntimeError('no sword')"), clock=clock)
    supervisor.start()
    delays = []
    for _ in range(module.QUICK_DEATHS - 1):
        died = poll_until(supervisor, "died")[-1]
        delays.append(died.delay)
        assert supervisor.poll() == []  # not yet due
        clock.advance(died.delay + 0.001)
        assert [event.kind for event in supervisor.poll()] == ["restarted"]
    assert delays == [0.2, 0.4, 0.8, 1.6]
    last = poll_until(supervisor, "gave_up")[-1]
    assert "RuntimeError: no sword" in last.tail
    assert last.describe == "a gave up (exit code 1): RuntimeError: no sword"
    assert last.tail.count("RuntimeError") == 1  # of its last life only
    clock.advance(100)
    assert supervisor.poll() == []


def test_bad_input_is_given_up_at_once(supervise):
    supervisor = supervise(spec("a", "import sys; sys.exit(2)"))
    supervisor.start()
    assert [event.kind for event in poll_until(supervisor, "gave_up")] == ["died", "gave_up"]
    assert supervisor.restarts == {"a": 0}


def test_a_long_life_clears_the_record(supervise):
    clock = ManualClock()
    supervisor = supervise(spec("a", FOREVER), clock=clock)
    supervisor.start()
    for _ in range(module.QUICK_DEATHS + 1):
        clock.advance(module.QUICK_SECONDS + 1)
        os.kill(supervisor.pids["a"], signal.SIGKILL)
        assert poll_until(supervisor, "died")[-1].delay == module.FIRST_DELAY
        clock.advance(module.FIRST_DELAY + 0.001)
        supervisor.poll()
    assert supervisor.restarts["a"] == module.QUICK_DEATHS + 1


def test_processes_stop_in_reverse_order_and_the_deaf_one_is_killed(supervise, tmp_path: Path):
    supervisor = supervise(
        spec("a", FOREVER), spec("b", STUBBORN, stop_seconds=0.3), spec("c", FOREVER)
    )
    supervisor.start()
    for name in "abc":
        until(said(tmp_path, name, "up"))
    events = supervisor.stop()
    assert [(event.name, event.kind) for event in events] == [
        ("c", "stopped"), ("b", "killed"), ("a", "stopped"),
    ]  # fmt: skip
    assert supervisor.stop() == []


def test_what_a_process_left_behind_ends_with_it(supervise, tmp_path: Path):
    code = (
        "import subprocess, sys; child = subprocess.Popen([sys.executable, '-S', '-c', "
        "'import signal; signal.pause()']); print('child', child.pid, flush=True)\n"
        "import signal; signal.pause()"
    )
    supervisor = supervise(spec("a", code))
    supervisor.start()
    until(said(tmp_path, "a", "child"))
    grandchild = int((tmp_path / "a.out").read_text(encoding="utf-8").split()[1])
    os.kill(supervisor.pids["a"], signal.SIGKILL)
    poll_until(supervisor, "died")
    until(lambda: not is_running(grandchild))


PARENT = """
import sys, pathlib, signal
from services.supervisor import ProcessSpec, Supervisor
from shared.clock import SystemClock
code = "import signal; signal.signal(signal.SIGTERM, signal.SIG_IGN); signal.pause()"
specs = [ProcessSpec(name, (sys.executable, "-S", "-c", code)) for name in ("a", "b")]
supervisor = Supervisor(specs, pathlib.Path(sys.argv[1]), SystemClock())
supervisor.start()
print(*supervisor.pids.values(), flush=True)
signal.pause()
"""


def is_running(pid: int) -> bool:
    try:
        return psutil.Process(pid).status() != psutil.STATUS_ZOMBIE
    except psutil.NoSuchProcess:
        return False


def test_no_process_survives_the_kill_of_its_supervisor(tmp_path: Path):
    command = [sys.executable, "-c", PARENT, tmp_path]
    with subprocess.Popen(command, stdout=subprocess.PIPE) as parent:
        assert parent.stdout is not None
        children = [int(pid) for pid in parent.stdout.readline().split()]
        assert len(children) == 2
        assert all(is_running(pid) for pid in children)
        parent.kill()
        parent.wait(10)
    until(lambda: not any(is_running(pid) for pid in children))


def test_a_process_that_never_stops_talking_does_not_fill_the_disk(supervise, tmp_path: Path):
    chatter = "import time\nwhile True: print('x' * 9999, flush=True); time.sleep(0.001)"
    supervisor = supervise(spec("chatter", chatter))
    supervisor.start()
    output = tmp_path / "chatter.out"
    sizes = [0]

    def was_emptied_twice() -> bool:
        supervisor.poll()
        sizes.append(output.stat().st_size)
        return sum(b < a for a, b in itertools.pairwise(sizes)) >= 2

    until(was_emptied_twice)
    assert max(sizes) < 2 * module.OUTPUT_BYTES


def test_a_program_that_is_not_there_is_given_up_and_named(supervise):
    supervisor = supervise(ProcessSpec("a", ("/nowhere/to/be/found",), restart=False))
    supervisor.start()
    gave_up = poll_until(supervisor, "gave_up")[-1]
    assert "cannot run /nowhere/to/be/found" in gave_up.describe


def test_two_processes_of_one_name_are_a_bug(tmp_path: Path):
    with pytest.raises(ValueError, match="must differ: a, a"):
        Supervisor([spec("a", ""), spec("a", "")], tmp_path, SystemClock())
