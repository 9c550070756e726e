"""What the bus and the codec cost of a training run's CPU seconds, and what they could carry.

Every service of a real run is started with its bus timed (``counted_service``). Counted as bus:
all of the router; in the other processes every call into the bus on the service's own thread
(encoding, decoding, sending, waiting) and every other thread, Zenoh's or not; only in the recorder
Rerun's threads are left out. So the share errs upward, never downward.
"""

import json
from pathlib import Path
from typing import Any

from benchmarks import throughput
from benchmarks.harness import median
from benchmarks.training_run import ENDLESS, training_run
from services.jobs.bench import Check, Measurement

QUESTION = "which share of a training run's CPU seconds goes into bus and codec"
GOAL = 0.05
RERUN_THREADS = ("ChunkBatcher", "RecordingStream", "jemalloc", "rerun", "re_", "log_sink")
"""How the names of the recorder's own threads begin."""


def cost(path: Path, began_at: float, ended_at: float) -> dict[str, float]:
    """Return the CPU seconds a second of one process and of the bus in it, within a window."""
    lines = [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]
    inside = [line for line in lines if began_at <= line["at"] <= ended_at]
    first, last = (inside[0], inside[-1]) if len(inside) > 1 else (lines[0], lines[-1])
    seconds = last["at"] - first["at"]
    threads = sum(
        used - first["threads"].get(name, 0.0)
        for name, used in last["threads"].items()
        if not name.startswith(RERUN_THREADS)
    )
    return {
        "process": (last["process"] - first["process"]) / seconds,
        "bus": (last["calls"] - first["calls"] + threads) / seconds,
        "bus_calls": (last["calls"] - first["calls"]) / seconds,
    }


def share_of_a_run(seconds: float) -> dict[str, Any]:
    """Return what one training run spent, and on the bus, in CPU seconds a second."""
    with training_run(ENDLESS, wrap="benchmarks.counted_service") as run:
        window = run.window(seconds)
        found = {
            path.stem: cost(path, window["began_at"], window["ended_at"])
            for path in (run.folder / "bus-cost").glob("*.jsonl")
        }
    router = window["cpu_s_by_process"]["router-0"] / (window["ended_at"] - window["began_at"])
    found["router-0"] = {"process": router, "bus": router, "bus_calls": 0.0}
    bus = sum(cost["bus"] for cost in found.values())
    all_of_it = sum(cost["process"] for cost in found.values())
    return {
        "ratio": bus / all_of_it,
        "bus_cpu": bus,
        "all_cpu": all_of_it,
        "bus_us_per_sample": 1e6 * bus / window["samples_per_s"],
        "samples_per_s": window["samples_per_s"],
        "by_process": found,
    }


def measure(smoke: bool) -> Measurement:
    """Return the share of the bus in a training run, and the bus's own figures."""
    seconds, rounds = (1.0, 1) if smoke else (20.0, 3)
    runs = tuple(share_of_a_run(seconds) for _ in range(rounds))
    alone = throughput.figures(smoke)
    trip, codec = alone["round_trip"], alone["codec"]
    return Measurement(
        value=median(runs, "bus_cpu"),
        unit="CPU seconds a second",
        limit=median(runs, "all_cpu"),
        ratio=Check(
            name="bus and codec / CPU of all processes",
            value=median(runs, "ratio"),
            goal=GOAL,
            goal_is="at most",
        ),
        runs=runs,
        checks=(
            Check(name="bus CPU a sample", value=median(runs, "bus_us_per_sample"), unit="us"),
            Check(name="acknowledged rollouts", value=alone["mb_per_s"], unit="MB/s"),
            Check(name="the same over bare TCP", value=alone["bare_tcp_mb_per_s"], unit="MB/s"),
            Check(name="encode a rollout", value=codec["encode_us"], unit="us"),
            Check(name="decode and check a rollout", value=codec["decode_us"], unit="us"),
            Check(name="round trip, p50", value=trip["p50_ms"], unit="ms"),
            Check(name="round trip, p99", value=trip["p99_ms"], unit="ms"),
        ),
        details=alone,
    )
