"""Acknowledged messages of a rollout's size: our bus against a bare socket, ZeroMQ and gRPC.

All between two processes of one machine, four messages under way at a time, rounds interleaved.
The others carry bytes and nothing else over the loopback, straight from one process to the other;
ours encodes, checks and decodes a rollout, goes through a router, and repeats what is not
acknowledged: by way of shared memory, as it does on one machine, over sockets, as between two, and
over sockets and mutual TLS, each end with the rights of its role.
"""

import contextlib
import datetime
import json
import os
import subprocess
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

from benchmarks.environments import interpreter
from benchmarks.harness import ROOT, cpu_seconds, interleaved, median
from benchmarks.throughput import Link, a_rollout, linked, rollouts
from services.jobs.bench import Check, Measurement
from services.jobs.certs.folder import keep
from shared.messages.wire import encode

QUESTION = "MB/s and CPU a MB of acknowledged rollouts: our bus against TCP, ZeroMQ and gRPC"
OTHERS = ("tcp", "zeromq", "grpc")
KINDS = ("ours", "ours over sockets", "ours over mutual TLS", *OTHERS)
SHARE_OF_GRPC = 1.0
"""Ours may cost at most this times what gRPC costs, CPU a MB."""
SECONDS = 120.0


def carried(kind: str, size: int, rounds: int) -> dict[str, float]:
    """Return rate and CPU of one way to carry ``rounds`` messages.

    Args:
        kind: one of `OTHERS`.
        size: of a message (bytes).
        rounds: how many messages.
    """
    python = interpreter("wires")
    command = [str(python), "-m", "benchmarks.wires.ends", kind, "--size", str(size)]
    plain = os.environ | {"PYTHONPATH": str(ROOT)}
    receiver = subprocess.Popen(
        [*command, "--receive"], stdout=subprocess.PIPE, text=True, cwd=ROOT, env=plain
    )
    try:
        assert receiver.stdout is not None
        port = receiver.stdout.readline().strip()
        before = cpu_seconds([receiver.pid])
        done = subprocess.run(
            [*command, "--send", port, "--rounds", str(rounds)], capture_output=True, text=True,
            check=True, cwd=ROOT, env=plain, timeout=SECONDS,
        )  # fmt: skip
        cpu = cpu_seconds([receiver.pid]) - before
    finally:
        receiver.kill()
        receiver.communicate()
    sent = json.loads(done.stdout)
    megabytes = rounds * size / 1e6
    return {
        "mb_per_s": megabytes / sent["wall_s"],
        "cpu_ms_per_mb": 1e3 * (cpu + sent["cpu_s"]) / megabytes,
    }


def measure(smoke: bool) -> Measurement:
    """Return rate and CPU of all of them."""
    messages, rounds = (20, 1) if smoke else (400, 7)
    size = len(encode(a_rollout()))
    with tempfile.TemporaryDirectory() as folder, contextlib.ExitStack() as stack:
        keep(Path(folder), ["127.0.0.1"], [], datetime.datetime.now(datetime.UTC), 1)
        links = [
            stack.enter_context(one)
            for one in (
                linked(),
                linked(shared_memory=False),
                linked(shared_memory=False, certificates=folder),
            )
        ]

        def ours(link: Link) -> Callable[[], dict[str, float]]:
            return lambda: rollouts(link.bus, messages, link.processes)

        def other(kind: str) -> Callable[[], dict[str, float]]:
            return lambda: carried(kind, size, messages)

        own = [ours(link) for link in links]
        for side in own:  # once, to be warm
            side()
        turns = interleaved(rounds, [*own, *(other(kind) for kind in OTHERS)])
    runs: tuple[dict[str, Any], ...] = tuple(
        {
            f"{kind} {name}": figures[name]
            for kind, figures in zip(KINDS, turn, strict=True)
            for name in ("mb_per_s", "cpu_ms_per_mb")
        }
        | {"ratio": turn[0]["cpu_ms_per_mb"] / turn[-1]["cpu_ms_per_mb"]}
        for turn in turns
    )
    return Measurement(
        value=median(runs, "ours cpu_ms_per_mb"),
        unit="CPU ms a MB",
        limit=median(runs, "grpc cpu_ms_per_mb"),
        ratio=Check(
            name="ours / gRPC, CPU a MB", value=median(runs, "ratio"), goal=SHARE_OF_GRPC,
            goal_is="at most",
        ),
        runs=runs,
        checks=tuple(
            Check(name=f"{kind}, {what}", value=median(runs, f"{kind} {name}"), unit=unit)
            for kind in KINDS
            for what, name, unit in (
                ("rate", "mb_per_s", "MB/s"), ("CPU a MB", "cpu_ms_per_mb", "ms"),
            )
        ),
        details={"message_bytes": size},
    )  # fmt: skip
