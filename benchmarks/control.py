"""The control path under load: bat states read -> command sent, beside a bare round trip.

A match between two policies (router, recorder, robot_io, policies, referee: what `riposte play`
starts) shares one core; a training run keeps the other busy. Two bare Zenoh processes bounce as
many bytes as the bat states over the match's own router, on the match's core, at the same time. A
tick that came more than 10 ms late, or never, counts as late. ``--seconds`` of
``python -m benchmarks.control`` chooses another time than ten minutes.
"""

import argparse
import contextlib
import json
import os
import shutil
import subprocess
import tempfile
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, Literal

import numpy as np

from benchmarks.harness import on_cores, process
from benchmarks.training_run import ENDLESS, WARM_VERSION, TrainingRun, training_run
from services.jobs.bench import Check, Measurement, report_of, text_of
from services.jobs.play.match import Match, Terms
from services.jobs.play.plan import Plan, parse, plan_of
from services.jobs.play.processes import processes
from services.supervisor import Supervisor
from shared.bus.base import Bus
from shared.bus.config import BusConfig
from shared.bus.ports import free_port
from shared.bus.zenoh import open_zenoh
from shared.clock import SystemClock
from shared.errors import RiposteError
from shared.messages.live import ServiceStatus
from shared.messages.play import BatStates, GateRequest, GateState
from shared.messages.topics import ARM, BATS, GATE, STATUS
from shared.messages.wire import encode
from shared.runtime.logging import configure_logging

QUESTION = "bat states read to command sent, 100 a second, while a training run has the other core"
GOAL = 0.01
SECONDS, SMOKE_SECONDS = 600.0, 4.0
PART_SECONDS = 60.0
"""Length of one entry of the rounds."""
START_SECONDS = 90.0
MATCH = ("--antagonist", "scripted:stab", "--protagonist", "style-1")
SETTINGS = ("play.rest=0.0", "recorder.live=false")
PERIOD_MS = 10.0
CLOSE_MS = 1.0
"""A bare round trip that begins so soon after states were read meets what the command meets."""


class Site:
    """The processes of a match, and a seat to watch from; who watches is the person."""

    def __init__(self, folder: Path, settings: Sequence[str] = SETTINGS) -> None:
        self.folder = folder
        words = [*MATCH, "--out", str(folder / "match")]
        plan = plan_of(parse([*words, *(word for item in settings for word in ("--set", item))]))
        plan.folder.mkdir(parents=True)
        (plan.folder / "config.toml").write_text(plan.settings, encoding="utf-8")
        self.endpoint = f"tcp/127.0.0.1:{free_port()}"
        self._clock = SystemClock()
        self._supervisor = Supervisor(
            processes(plan, self.endpoint), plan.folder / "logs", self._clock
        )
        self._supervisor.start()
        cfg = BusConfig(connect=(self.endpoint,), open_seconds=60.0)
        self.bus: Bus = open_zenoh(cfg, "bench", self._clock, plan.run)
        self.match = Match(_terms(plan), self.bus, self._clock)
        self._gates = self.bus.subscribe(GATE)
        self._bats = self.bus.subscribe(BATS)
        self._statuses = self.bus.subscribe(STATUS, role="robot-io")
        self.gates: list[GateState] = []
        self.read_ns: list[int] = []
        """When bat states were read, by the wall clock."""
        self.states: BatStates | None = None
        self.status: ServiceStatus | None = None
        self.trips = 0
        self._match_at = 0.0

    def tick(self) -> None:
        """Listen to every tick; drive the match a few times a second.

        Raises:
            RiposteError: a process died.
        """
        self.bus.wait(0.05)
        while (gate := self._gates.take()) is not None:
            self.gates.append(gate)
        while (states := self._bats.take()) is not None:
            self.states = states
            self.read_ns.append(states.at_ns)
        while (status := self._statuses.take()) is not None:
            self.status = status
        if (now := self._clock.now()) < self._match_at:
            return
        self._match_at = now + 0.1
        self.match.tick()
        self.match.take_events()
        mode = "" if self.match.gate is None else self.match.gate.mode
        if mode == "tripped":
            self.trips += 1
            self._ask_gate("reset")
        if mode == "tripped" or (self.trips and mode == "disarmed"):
            self._ask_gate("arm")  # refused while it still moves: asked again
        for event in self._supervisor.poll():
            raise RiposteError(f"{event.describe}\n{event.tail}")

    def _ask_gate(self, action: Literal["arm", "reset"]) -> None:
        pending = self.bus.ask(ARM, GateRequest(action=action, operator="bench"), 1.0)
        while pending.take() is None:
            self.bus.wait(0.05)

    def until_fencing(self) -> None:
        """Wait until a bout runs.

        Raises:
            RiposteError: it does not, within the deadline.
        """
        end = time.monotonic() + START_SECONDS
        while not (self.match.is_bout_on and self.status is not None):
            if time.monotonic() > end:
                raise RiposteError(f"no bout within {START_SECONDS:g} s: {self.match.waits_for}")
            self.tick()

    def fresh_status(self) -> ServiceStatus:
        """Return the next status of robot_io: its counts are exact, whatever is heard of ticks."""
        self.status = None
        end = time.monotonic() + START_SECONDS
        while self.status is None:
            if time.monotonic() > end:
                raise RiposteError("robot_io says nothing of itself")
            self.tick()
        return self.status

    @property
    def pids(self) -> dict[str, int]:
        """Return the process ids by name."""
        return self._supervisor.pids

    def close(self) -> None:
        """End all processes."""
        self.bus.close()
        self._supervisor.stop()


def _terms(plan: Plan) -> Terms:
    return Terms(
        antagonist=plan.antagonist.reference, protagonist=plan.protagonist.reference, bouts=0,
        arms=True, starts=True, rest=0.0, patience=3600.0, operator="bench", again="",
    )  # fmt: skip


@contextlib.contextmanager
def live_site() -> Iterator[Site]:
    """Run a match in a folder of its own until the block ends."""
    folder = Path(tempfile.mkdtemp(prefix="riposte-control-"))
    site = Site(folder)
    try:
        yield site
    finally:
        site.close()
        shutil.rmtree(folder, ignore_errors=True)


def watched(seconds: float, *, is_alone: bool = False) -> dict[str, Any]:
    """Return what was seen of the loop, of the bare round trip and of the training run.

    Args:
        seconds: how long.
        is_alone: without a training run, on all cores.
    """
    cores = sorted(os.sched_getaffinity(0))
    with contextlib.ExitStack() as stack:
        training: TrainingRun | None = None
        if not is_alone:
            with on_cores(cores[-1]):
                training = stack.enter_context(training_run(ENDLESS))
            training.wait_for_version(WARM_VERSION)
            stack.enter_context(on_cores(cores[0]))
        site = stack.enter_context(live_site())
        site.until_fencing()
        assert site.states is not None
        size = len(encode(site.states))
        answerer = stack.enter_context(process("-m", "benchmarks.echo", site.endpoint, "--answer"))
        assert answerer.stdout is not None
        answerer.stdout.readline()
        asker = stack.enter_context(
            process(
                "-m", "benchmarks.echo", site.endpoint, "--ask", f"{seconds}", "--size", f"{size}"
            )
        )
        first_version = training.newest_checkpoint() if training else 0
        before, began_at = site.fresh_status(), time.monotonic()
        site.gates.clear()
        site.read_ns.clear()
        while time.monotonic() < began_at + seconds:
            site.tick()
        after = site.fresh_status()
        return {
            "gates": list(site.gates),
            "read_ns": list(site.read_ns),
            "counts": {
                name: after.counters[name] - before.counters[name] for name in after.counters
            },
            "bare": _finished(asker, site),
            "bytes": size,
            "bouts": site.match.finished,
            "trips": site.trips,
            "updates": training.newest_checkpoint() - first_version if training else 0,
        }


def _finished(asker: "subprocess.Popen[str]", site: Site) -> dict[str, Any]:
    """Return what the bare asker found; the match goes on meanwhile."""
    end = time.monotonic() + START_SECONDS
    while asker.poll() is None and time.monotonic() < end:
        site.tick()
    assert asker.stdout is not None
    text = asker.stdout.read()
    if not text:
        raise RiposteError("the bare round trip was not measured: its process said nothing")
    return json.loads(text)


def times(values: list[float]) -> dict[str, float]:
    """Return median, 99th percentile and largest of times."""
    p50, p99, most = np.percentile(np.array(values), (50, 99, 100))
    return {"p50": float(p50), "p99": float(p99), "max": float(most)}


def parts(gates: list[GateState]) -> tuple[dict[str, Any], ...]:
    """Return the figures of each minute, from the ticks that were heard."""
    step = round(PART_SECONDS / (PERIOD_MS / 1e3))
    made: list[dict[str, Any]] = []
    for begin in range(0, len(gates), step):
        part = gates[begin : begin + step]
        answers = answer_times(part)
        if answers:
            late = sum(gate.lateness_ms > PERIOD_MS for gate in part)
            made.append(
                {"ratio": late / len(part), "ticks": len(part), "command_ms": times(answers)}
            )
    return tuple(made)


def answer_times(gates: Sequence[GateState]) -> list[float]:
    """Return how old the states were that each command answered, when it was sent (ms).

    A tick without a command of the policy is left out; how many these are is a figure of its own.
    """
    return [
        gate.answer_ms + PERIOD_MS * (gate.tick - gate.answered_tick)
        for gate in gates
        if gate.answer_ms is not None and gate.answered_tick is not None
    ]


def beside_states(bare: dict[str, Any], read_ns: Sequence[int]) -> list[float]:
    """Return the times (ms) of the bare round trips that began as the control path does.

    Args:
        bare: what the asker found.
        read_ns: when states were read.
    """
    asked, known = np.array(bare["asked_ns"]), np.sort(np.array(read_ns))
    before = known[np.maximum(np.searchsorted(known, asked, side="right") - 1, 0)]
    since_ms = 1e-6 * (asked - before)
    is_close = (since_ms >= 0.0) & (since_ms < CLOSE_MS)
    return np.array(bare["times_ms"])[is_close].tolist()


def measurement(seen: dict[str, Any]) -> Measurement:
    """Return the figures of what was seen."""
    gates: list[GateState] = seen["gates"]
    counts: dict[str, int] = seen["counts"]
    answers = answer_times(gates)
    command, bare = times(answers), times(seen["bare"]["times_ms"])
    late = times([gate.lateness_ms for gate in gates])
    due = counts["ticks"] + counts["ticks_lost"]
    missed = counts["ticks_late"] + counts["ticks_lost"]
    heard = len({gate.tick for gate in gates})
    return Measurement(
        value=command["p50"],
        unit="ms",
        limit=bare["p50"],
        ratio=Check(
            name="ticks over 10 ms late, or lost / ticks", value=missed / due, goal=GOAL,
            goal_is="at most",
        ),
        runs=parts(gates),
        checks=(
            Check(name="states read to command sent, p99", value=command["p99"], unit="ms"),
            Check(name="the same, largest", value=command["max"], unit="ms"),
            Check(name="bare round trip, p99", value=bare["p99"], unit="ms"),
            Check(name="the same, largest", value=bare["max"], unit="ms"),
            Check(
                name="bare round trip begun with the states, p50",
                value=times(beside_states(seen["bare"], seen["read_ns"]))["p50"], unit="ms",
            ),
            Check(name="bare round trips missed", value=seen["bare"]["missed"]),
            Check(name="a tick began late by, p50", value=late["p50"], unit="ms"),
            Check(name="the same, p99", value=late["p99"], unit="ms"),
            Check(name="the same, largest", value=late["max"], unit="ms"),
            Check(name="ticks", value=due),
            Check(name="ticks over 10 ms late", value=counts["ticks_late"]),
            Check(name="ticks lost", value=counts["ticks_lost"]),
            Check(name="ticks without an answer in time", value=counts["commands_repeated"]),
            Check(name="ticks not heard here", value=max(counts["ticks"] - heard, 0)),
            Check(name="trips of the gate", value=seen["trips"]),
            Check(name="bouts", value=seen["bouts"]),
            Check(name="updates of the training run", value=seen["updates"]),
        ),
        details={"bytes": seen["bytes"], "counts": counts},
    )  # fmt: skip


def measure(smoke: bool) -> Measurement:
    """Return the times of the control path over ten minutes."""
    return measurement(watched(SMOKE_SECONDS if smoke else SECONDS))


def main() -> None:
    """Measure for a chosen time."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=SECONDS, help="(%(default)g)")
    parser.add_argument("--json", action="store_true", help="one JSON object")
    found = parser.parse_args()
    configure_logging(None)
    report = report_of("control", lambda: measurement(watched(found.seconds)), smoke=False)
    print(json.dumps(report) if found.json else text_of(report))


if __name__ == "__main__":
    main()
