"""``python -m services.jobs.chaos.robot.guest CONDUCT SEED ...``: a policy of a bad kind.

It joins a match as any policy does; the rest of the line is a policy's. CONDUCT is ``honest``,
``unreliable`` (loses, repeats, delays and reorders what it sends) or ``lying`` (answers every
second tick with a lie instead of the truth).
"""

import dataclasses
import sys
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import TypeVar

import structlog

from services.jobs.chaos.robot.lies import LIES, damaged
from services.policy.__main__ import build
from shared.bus import zenoh
from shared.bus.base import Bus
from shared.bus.faults import FaultPlan, FaultyBus
from shared.bus.wrapped import WrappedBus
from shared.clock import Clock
from shared.errors import ConfigError
from shared.messages.message import Message
from shared.messages.play import DesiredOffset
from shared.messages.topics import Topic
from shared.messages.wire import encode
from shared.runtime.serve import ServeArgs, open_site_bus, serve

Out = TypeVar("Out", bound=Message)

log = structlog.get_logger()

NO_LIMIT = 1 << 31
CONDUCTS = ("honest", "unreliable", "lying")
MAX_DELAY = 0.3
"""Of an unreliable policy (s); half an answer's life."""


class LyingBus(WrappedBus):
    """Wraps a policy's bus: instead of every second answer goes a lie, of each kind in turn."""

    def __init__(self, bus: Bus) -> None:
        super().__init__(bus)
        self.told: Counter[str] = Counter()
        self._answers = 0

    def publish(self, topic: Topic[Out], message: Out, **fields: str) -> None:
        """Send a value; the truth with every second answer."""
        if not isinstance(message, DesiredOffset):
            super().publish(topic, message, **fields)
            return
        self._answers += 1
        if self._answers % 2:
            super().publish(topic, message, **fields)
            return
        lie = tuple(LIES)[self._answers // 2 % len(LIES)]
        self.told[lie] += 1
        told, wide = LIES[lie](message), dataclasses.replace(topic, max_bytes=NO_LIMIT)
        if lie == "damaged bytes":  # which no message can say: a liar's own program writes them
            zenoh.encode = _damaged
        try:
            for _ in range(3 if lie == "sent again" else 1):
                self._bus.publish(wide, told, **fields)  # type: ignore[arg-type]
        finally:
            zenoh.encode = encode


def _damaged(message: Message) -> bytes:
    return damaged(encode(message))


def main(argv: Sequence[str]) -> int:
    """Run the guest until it is told to stop; return its exit code."""
    conduct, seed, *words = argv
    if conduct not in CONDUCTS:
        raise ConfigError(f"conduct is {conduct!r}; it may be {', '.join(CONDUCTS)}")
    did: list[Mapping[str, int]] = []

    def open_bus(args: ServeArgs, clock: Clock) -> Bus:
        bus = open_site_bus(args, clock)
        if conduct == "honest":
            return bus
        if conduct == "lying":
            liar = LyingBus(bus)
            did.append(liar.told)
            return liar
        plan = FaultPlan(
            seed=int(seed), drop=0.1, duplicate=0.3, delay=0.3, reorder=0.3, max_delay=MAX_DELAY
        )
        faulty = FaultyBus(bus, plan, clock)
        did.append(faulty.faults)
        return faulty

    code = serve("policy", build, words, open_bus=open_bus)
    if did:
        log.info("conduct", did=dict(did[0]))
    return code


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
