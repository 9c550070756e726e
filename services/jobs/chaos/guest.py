"""``python -m services.jobs.chaos.guest CONDUCT SEED ...``: an actor that misbehaves on the bus.

It joins a run as any actor does; the rest of the line is an actor's. CONDUCT is ``unreliable``
(loses, repeats, delays and reorders what it sends) or ``lying`` (tells lies beside the truth).
"""

import dataclasses
import sys
from collections.abc import Sequence
from typing import Any, TypeVar

import msgspec
import structlog

from services.actor.__main__ import build
from services.jobs.chaos.lies import FORGED, FORGERIES, LIES, POLICY_LIE
from shared.bus import endpoints
from shared.bus.base import Bus, Pending
from shared.bus.faults import FaultPlan, FaultyBus
from shared.bus.wrapped import WrappedBus
from shared.clock import Clock
from shared.errors import ConfigError
from shared.messages.message import Message
from shared.messages.topics import POLICY, ROLLOUT, VERSION, Service
from shared.messages.training import (
    AGENTS,
    PolicyAnnouncement,
    Receipt,
    Rollout,
    VersionReceipt,
    VersionReport,
)
from shared.runtime.serve import ServeArgs, open_site_bus, serve

In = TypeVar("In", bound=Message)
Out = TypeVar("Out", bound=Message)

log = structlog.get_logger()

ANSWER_SECONDS = 5.0
NO_LIMIT = 1 << 31
CONDUCTS = ("unreliable", "lying")


class LyingBus(WrappedBus):
    """Wraps an actor's bus: behind each rollout goes a lie, until all of them are told."""

    def __init__(self, bus: Bus) -> None:
        super().__init__(bus)
        self._answers: list[tuple[str, str, Pending[Any]]] = []
        self._policies = [bus.subscribe(POLICY, agent=agent) for agent in AGENTS]
        self._forgery = ""
        self._told = 0
        self._has_corrupted = False
        genuine = endpoints.encode

        def written(message: Message) -> bytes:
            payload = genuine(message)
            forge = FORGERIES.get(self._forgery)
            return forge(payload) if forge and isinstance(message, Rollout) else payload

        endpoints.encode = written  # a liar's own program; nobody else's

    def ask(
        self, service: Service[In, Out], message: In, timeout: float, **fields: str
    ) -> Pending[Out]:
        """Send a request, and after a rollout the next lie."""
        pending = super().ask(service, message, timeout, **fields)
        if isinstance(message, Rollout):
            self._tell(message)
        return pending

    def wait(self, timeout: float) -> bool:
        """Note how lies were answered, then wait."""
        left: list[tuple[str, str, Pending[Any]]] = []
        for lie, name, pending in self._answers:
            answer = pending.take()
            if answer is None:
                left.append((lie, name, pending))
            elif isinstance(answer, Receipt | VersionReceipt) and answer.accepted:
                log.info("lie_accepted", lie=lie, name=name)
            else:
                log.info("lie_refused", lie=lie, name=name, reason=answer.reason)
        self._answers = left
        for subscription in self._policies:
            while (policy := subscription.take()) is not None:
                self._corrupt(policy)
        return super().wait(timeout)

    def _tell(self, rollout: Rollout) -> None:
        """Tell the next lie, made of a rollout; each is told once."""
        if self._told == len(LIES):
            return
        lie = tuple(LIES)[self._told]
        self._told += 1
        told = LIES[lie](rollout)
        service = dataclasses.replace(ROLLOUT, max_bytes=NO_LIMIT)
        if told.sequence >= FORGED:
            self._note(lie, told.name, is_forged=True)
        self._forgery = lie
        try:
            pending = self._bus.ask(service, told, ANSWER_SECONDS, agent=rollout.agent)
        finally:
            self._forgery = ""
        if told.sequence >= FORGED:  # else it is the truth, told twice
            self._answers.append((lie, told.name, pending))

    def _corrupt(self, policy: PolicyAnnouncement) -> None:
        """Send a learner's policy on with one byte changed: to the actors, and to the league."""
        if self._has_corrupted or self._told == 0:
            return
        self._has_corrupted = True
        payload = policy.payload.copy()
        payload[len(payload) // 2] ^= 0xFF
        forged = msgspec.structs.replace(
            policy, payload=payload, policy_version=policy.policy_version + 1
        )
        self._note(POLICY_LIE, forged.snapshot, is_forged=False)
        self._bus.publish(POLICY, forged, agent=policy.agent)
        self._note("corrupt snapshot", forged.snapshot, is_forged=False)
        report = VersionReport(
            agent=policy.agent, policy_version=policy.policy_version + 1_000_000,
            stage=policy.stage, snapshot=policy.snapshot, payload=payload, rollouts=(),
        )  # fmt: skip
        pending = self._bus.ask(VERSION, report, ANSWER_SECONDS)
        self._answers.append(("corrupt snapshot", policy.snapshot, pending))

    def _note(self, lie: str, name: str, *, is_forged: bool) -> None:
        log.info("lie_told", lie=lie, name=name, is_forged=is_forged)


def main(argv: Sequence[str]) -> int:
    """Run the guest until it is told to stop; return its exit code."""
    conduct, seed, *words = argv
    if conduct not in CONDUCTS:
        raise ConfigError(f"conduct is {conduct!r}; it may be {' or '.join(CONDUCTS)}")

    def open_bus(args: ServeArgs, clock: Clock) -> Bus:
        bus = open_site_bus(args, clock)
        if conduct == "lying":
            return LyingBus(bus)
        plan = FaultPlan(
            seed=int(seed), drop=0.1, drop_answer=0.1, duplicate=0.3, delay=0.3, reorder=0.3,
            max_delay=1.0,
        )  # fmt: skip
        return FaultyBus(bus, plan, clock)

    return serve("actor", build, words, open_bus=open_bus)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
