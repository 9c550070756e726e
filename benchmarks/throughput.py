"""What the bus can carry: codec, round trip, and rollouts from one process to another and back.

One actor asks, one learner answers, a router in a third process carries; beside it, in the same
run, the same bytes go through a bare TCP connection of the loopback and are acknowledged there.
Part of ``riposte bench bus``.
"""

import argparse
import contextlib
import dataclasses
import socket
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import psutil

from benchmarks.harness import ROOT
from shared.bus.config import BusConfig
from shared.bus.ports import free_port
from shared.bus.zenoh import ZenohBus, open_zenoh
from shared.clock import SystemClock
from shared.messages.league import Lease, LeaseRequest
from shared.messages.topics import LEASE, ROLLOUT
from shared.messages.training import ACTION_DIM, OBS_DIM, Receipt, Rollout
from shared.messages.wire import decode, encode

WINDOW = 4
"""Rollouts under way at a time."""
START_SECONDS = 20.0
RUN = "bench"
REQUEST = LeaseRequest(actor="actor-0", boot="b0", num_envs=128)


def a_rollout(T: int = 40, N: int = 128) -> Rollout:
    """Return a rollout of the default size."""
    rng = np.random.default_rng(0)

    def noise(*shape: int) -> Any:
        return rng.standard_normal(shape).astype(np.float32)

    return Rollout(
        agent="antagonist", actor="actor-0", boot="b" * 16, sequence=7, lease="l" * 16, stage=2,
        policy_version=5, snapshot="ab" * 32, opponent="sha256:" + "ab" * 32, model="cd" * 32,
        seed=1, bouts=np.arange(N), first_step=np.zeros(N, np.int32), obs=noise(T, N, OBS_DIM),
        last_obs=noise(N, OBS_DIM), actions=noise(T, N, ACTION_DIM), means=noise(T, N, ACTION_DIM),
        stds=noise(ACTION_DIM), log_probs=noise(T, N), rewards=noise(T, N),
        truncated=np.zeros(N, bool),
    )  # fmt: skip


def codec(rounds: int) -> dict[str, float]:
    """Return microseconds of CPU to encode and to decode one rollout (medians)."""
    message = a_rollout()
    payload = encode(message)
    return {
        "encode_us": median_us(lambda: encode(message), rounds),
        "decode_us": median_us(lambda: decode(Rollout, payload, ROLLOUT.max_bytes), rounds),
        "payload_bytes": len(payload),
    }


def median_us(call: Callable[[], object], rounds: int) -> float:
    """Return the median CPU time of a call."""
    times: list[float] = []
    for _ in range(rounds):
        begin = time.process_time_ns()
        call()
        times.append((time.process_time_ns() - begin) / 1e3)
    return statistics.median(times)


def round_trips(bus: ZenohBus, rounds: int) -> dict[str, float]:
    """Return milliseconds from asking to holding the answer of a small request."""
    times: list[float] = []
    for _ in range(rounds):
        begin = time.perf_counter()
        pending = bus.ask(LEASE, REQUEST, 5.0)
        while (answer := pending.take()) is None:
            bus.wait(5.0)
        if not isinstance(answer, Lease):
            raise SystemExit(f"no answer: {answer}")
        times.append(1e3 * (time.perf_counter() - begin))
    times.sort()
    return {"p50_ms": times[len(times) // 2], "p99_ms": times[-1 - len(times) // 100]}


def rollouts(bus: ZenohBus, rounds: int, processes: list[psutil.Process]) -> dict[str, float]:
    """Return the rate and the CPU time, of all processes, of acknowledged rollouts."""
    message = a_rollout()
    size = len(encode(message))
    pendings: list[Any] = []
    sent = done = 0
    cpu_before, begin = cpu_seconds(processes), time.perf_counter()
    while done < rounds:
        while sent < rounds and len(pendings) < WINDOW:
            pendings.append(bus.ask(ROLLOUT, message, 10.0, agent="antagonist"))
            sent += 1
        bus.wait(1.0)
        left = [pending for pending in pendings if pending.take() is None]
        for pending in pendings:
            answer = pending.take()
            if answer is not None and not isinstance(answer, Receipt):
                raise SystemExit(f"no receipt: {answer}")
        done += len(pendings) - len(left)
        pendings = left
    wall, cpu = time.perf_counter() - begin, cpu_seconds(processes) - cpu_before
    megabytes = rounds * size / 1e6
    return {
        "mb_per_s": megabytes / wall,
        "cpu_ms_per_mb": 1e3 * cpu / megabytes,
        "cpu_us_per_sample": 1e6 * cpu / (rounds * 40 * 128),
        "wall_s": wall,
        "cpu_s": cpu,
    }


def bare_tcp(rounds: int, size: int) -> float:
    """Return MB/s of the same bytes through one TCP connection, acknowledged by one byte."""
    with start("tcp", "--receive", "--size", str(size), module="benchmarks.wires.ends") as process:
        assert process.stdout is not None
        port = int(process.stdout.readline())
        payload = bytes(size)
        with socket.create_connection(("127.0.0.1", port), timeout=30) as link:
            begin = time.perf_counter()
            for number in range(rounds):
                link.sendall(payload)
                if number >= WINDOW:
                    link.recv(1)
            for _ in range(min(rounds, WINDOW)):
                link.recv(1)
            return rounds * size / 1e6 / (time.perf_counter() - begin)


def answer(cfg: BusConfig) -> None:
    """Answer everything at once, until killed: the other end of the bus."""
    bus = open_zenoh(cfg, "learner", SystemClock(), RUN, "learner")
    leases, inbox = bus.answer(LEASE), bus.answer(ROLLOUT, agent="antagonist")
    bus.declare_alive("learner")
    while True:
        bus.wait(1.0)
        while (request := leases.take()) is not None:
            request.reply(Lease(lease="x", kind="none"))
        while (rollout := inbox.take()) is not None:
            rollout.reply(Receipt(accepted=True))


def cpu_seconds(processes: list[psutil.Process]) -> float:
    """Return the CPU seconds used so far by all of them."""
    return sum(sum(process.cpu_times()[:2]) for process in processes)


@contextlib.contextmanager
def start(*args: str, module: str = "") -> Iterator[subprocess.Popen[str]]:
    """Run this script, or a module, in a process of its own until the block ends."""
    program = ["-m", module] if module else ["-m", "benchmarks.throughput"]
    command = [sys.executable, *program, *args]
    process = subprocess.Popen(
        command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
    )
    try:
        yield process
    finally:
        process.kill()
        process.wait()
        if process.stdout:
            process.stdout.close()


@dataclasses.dataclass(frozen=True)
class Link:
    """An actor's end of a bus that has a router and a learner that answers."""

    bus: ZenohBus
    processes: list[psutil.Process]
    """This one, the router and the learner."""


def _answers(bus: ZenohBus) -> bool:
    """Return whether a rollout is answered; an actor may not see who else is there."""
    pending = bus.ask(ROLLOUT, a_rollout(1, 1), 1.0, agent="antagonist")
    while (answer := pending.take()) is None:
        bus.wait(0.1)
    return isinstance(answer, Receipt)


@contextlib.contextmanager
def linked(*, shared_memory: bool = True, certificates: str = "") -> Iterator[Link]:
    """Start router and learner, and stop them when the block ends.

    Args:
        shared_memory: pass large messages through it, as processes of one machine do; else through
            sockets, as between machines.
        certificates: folder of them: over mutual TLS, each with the rights of its role; in the
            clear without one.
    """
    words = () if shared_memory else ("--set", "bus.shared_memory=false")
    ends = () if shared_memory else ("--sockets",)
    if certificates:
        words, ends = ((*some, "--certificates", certificates) for some in (words, ends))
    endpoint = f"{'tls' if certificates else 'tcp'}/127.0.0.1:{free_port()}"
    with (
        tempfile.TemporaryDirectory() as folder,
        start("--run", folder, "--listen", endpoint, *words, module="services.router") as router,
        start("--answer", endpoint, *ends) as learner,
        contextlib.closing(
            open_zenoh(
                BusConfig(
                    connect=(endpoint,), shared_memory=shared_memory, certificates=certificates
                ),
                "actor-0",
                SystemClock(),
                RUN,
                "actor",
            )
        ) as bus,
    ):
        deadline = time.monotonic() + START_SECONDS
        while not _answers(bus):
            if time.monotonic() > deadline:
                raise SystemExit(f"the learner did not come up within {START_SECONDS:g} s")
        others = [psutil.Process(router.pid), psutil.Process(learner.pid)]
        yield Link(bus, [psutil.Process(), *others])


def figures(smoke: bool) -> dict[str, Any]:
    """Return codec, round trip and rate of acknowledged rollouts, medians of the rounds."""
    rounds = 10 if smoke else 200
    runs: list[dict[str, float]] = []
    codec_figures = codec(5 * rounds)
    size = int(codec_figures["payload_bytes"])
    with linked() as link:
        rollouts(link.bus, 10, link.processes)
        for _ in range(1 if smoke else 5):
            limit = bare_tcp(rounds, size)
            runs.append({**rollouts(link.bus, rounds, link.processes), "bare_tcp_mb_per_s": limit})
        trips = round_trips(link.bus, 5 * rounds)

    def middle(name: str) -> float:
        return statistics.median(run[name] for run in runs)

    return {
        "mb_per_s": middle("mb_per_s"),
        "bare_tcp_mb_per_s": middle("bare_tcp_mb_per_s"),
        "cpu_ms_per_mb": middle("cpu_ms_per_mb"),
        "cpu_us_per_sample": middle("cpu_us_per_sample"),
        "codec": codec_figures,
        "round_trip": trips,
        "runs": runs,
    }


def main() -> None:
    """Be the other end of the bus."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--answer", required=True, metavar="ENDPOINT")
    parser.add_argument("--sockets", action="store_true", help="no shared memory")
    parser.add_argument("--certificates", default="", metavar="DIR", help="over mutual TLS")
    found = parser.parse_args()
    answer(
        BusConfig(
            connect=(found.answer,),
            shared_memory=not found.sockets,
            certificates=found.certificates,
        )
    )


if __name__ == "__main__":
    main()
