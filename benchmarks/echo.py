"""The bare limit of the control path: a round trip over the same router with nothing around it.

``python -m benchmarks.echo ENDPOINT --answer`` sends back what arrives, from the library's own
thread; ``--ask SECONDS --size BYTES`` sends some hundred a second and prints the times as JSON.
"""

import argparse
import json
import sys
import threading
import time
from typing import Any

import zenoh

from shared.bus.config import BusConfig, client_json

THERE, BACK = "riposte/bare/there", "riposte/bare/back"
PERIOD = 0.0103
"""A little longer than the loop's, so that it asks at all moments of that: with the same one it
would ask at one moment, which is a matter of luck, and is 4 times slower where all of a match's
processes are awake (s)."""
PATIENCE = 0.1
"""An answer that takes longer is missed (s)."""


def open_session(endpoint: str) -> Any:
    """Return a session with the configuration that every process of a run has."""
    zenoh.init_log_from_env_or("error")
    cfg = BusConfig(connect=(endpoint,))
    return zenoh.open(zenoh.Config.from_json5(client_json(cfg, "operator")))


def answer(endpoint: str) -> None:
    """Send back what arrives, until killed."""
    session = open_session(endpoint)
    publisher = session.declare_publisher(BACK)
    subscriber = session.declare_subscriber(THERE, lambda sample: publisher.put(sample.payload))
    print("ready", flush=True)
    threading.Event().wait()
    subscriber.undeclare()


def ask(endpoint: str, seconds: float, size: int) -> dict[str, Any]:
    """Return when trips began (ns, wall clock), what they took (ms), and how many were missed."""
    session = open_session(endpoint)
    publisher = session.declare_publisher(THERE)
    came = threading.Event()
    newest = [0]

    def take(sample: Any) -> None:
        newest[0] = int.from_bytes(sample.payload.to_bytes()[:8], "little")
        came.set()

    subscriber = session.declare_subscriber(BACK, take)
    time.sleep(0.5)
    times: list[float] = []
    asked: list[int] = []
    missed = 0
    due = time.perf_counter()
    end = due + seconds
    number = 0
    while due < end:
        time.sleep(max(due - time.perf_counter(), 0.0))
        number += 1
        came.clear()
        begin_ns, begin = time.time_ns(), time.perf_counter()
        publisher.put(number.to_bytes(8, "little") + bytes(size - 8))
        while came.wait(max(begin + PATIENCE - time.perf_counter(), 0.0)) and newest[0] != number:
            came.clear()
        if newest[0] == number:
            times.append(1e3 * (time.perf_counter() - begin))
            asked.append(begin_ns)
        else:
            missed += 1
        due = max(due + PERIOD, time.perf_counter() - PERIOD)
    subscriber.undeclare()
    session.close()
    return {"asked_ns": asked, "times_ms": times, "missed": missed}


def main() -> None:
    """Be one of the two ends."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("endpoint")
    parser.add_argument("--answer", action="store_true")
    parser.add_argument("--ask", type=float, metavar="SECONDS")
    parser.add_argument("--size", type=int, default=512, metavar="BYTES")
    found = parser.parse_args()
    if found.answer:
        answer(found.endpoint)
    else:
        json.dump(ask(found.endpoint, found.ask, found.size), sys.stdout)


if __name__ == "__main__":
    main()
