"""A bus that loses, repeats, delays and reorders, for tests; the same seed, the same faults."""

import dataclasses
from collections.abc import Callable
from typing import Any, Generic, TypeVar

import numpy as np

from shared.bus.base import Bus, NoAnswer, Pending, Refused
from shared.bus.wrapped import WrappedBus
from shared.clock import Clock
from shared.messages.message import Message
from shared.messages.topics import Service, Topic

In = TypeVar("In", bound=Message)
Out = TypeVar("Out", bound=Message)


@dataclasses.dataclass(frozen=True)
class FaultPlan:
    """How often what goes wrong; probabilities, each drawn on its own."""

    seed: int = 0
    drop: float = 0.0
    """A value or request never leaves."""
    drop_answer: float = 0.0
    """A request arrives and is answered, and the answer is lost."""
    duplicate: float = 0.0
    """A value or request leaves twice."""
    delay: float = 0.0
    """It leaves up to ``max_delay`` later."""
    reorder: float = 0.0
    """It leaves after the next one."""
    max_delay: float = 1.0
    """Seconds."""


class FaultyBus(WrappedBus):
    """Wraps one process's bus and does wrong to what that process publishes and asks."""

    def __init__(self, bus: Bus, plan: FaultPlan, clock: Clock) -> None:
        super().__init__(bus)
        self.faults: dict[str, int] = {
            "dropped": 0, "answers_dropped": 0, "duplicated": 0, "delayed": 0, "reordered": 0,
        }  # fmt: skip
        """How often each fault was committed."""
        self._plan = plan
        self._clock = clock
        self._rng = np.random.default_rng(plan.seed)
        self._later: list[tuple[float, Callable[[], None]]] = []
        self._after_next: list[Callable[[], None]] = []

    def publish(self, topic: Topic[Out], message: Out, **fields: str) -> None:
        """Send a value, or not, or more than once, or later."""

        def send() -> None:
            self._bus.publish(topic, message, **fields)

        if not self._strikes("drop", "dropped"):
            self._leave(send)

    def ask(
        self, service: Service[In, Out], message: In, timeout: float, **fields: str
    ) -> Pending[Out]:
        """Send a request, or not, or more than once, or later."""
        pending = _Disturbed[Out](self._clock, service.key, timeout)

        def send() -> None:
            asked = self._bus.ask(service, message, timeout, **fields)
            if pending.asked is None:
                pending.asked = asked

        pending.loses_answer = self._strikes("drop_answer", "answers_dropped")
        if not self._strikes("drop", "dropped"):
            self._leave(send)
        return pending

    def wait(self, timeout: float) -> bool:
        """Let go of what was held back long enough, then wait."""
        now = self._clock.now()
        due = [send for at, send in self._later if at <= now]
        self._later = [(at, send) for at, send in self._later if at > now]
        for send in due:
            send()
        return super().wait(timeout)

    def close(self) -> None:
        """Leave the bus; what was held back is lost."""
        self._later.clear()
        self._after_next.clear()
        super().close()

    def _leave(self, send: Callable[[], None]) -> None:
        held, self._after_next = self._after_next, []
        for _ in range(2 if self._strikes("duplicate", "duplicated") else 1):
            if self._strikes("delay", "delayed"):
                at = self._clock.now() + self._plan.max_delay * float(self._rng.random())
                self._later.append((at, send))
            elif self._strikes("reorder", "reordered"):
                self._after_next.append(send)
            else:
                send()
        for earlier in held:
            earlier()

    def _strikes(self, probability: str, counter: str) -> bool:
        strikes = bool(self._rng.random() < getattr(self._plan, probability))
        self.faults[counter] += strikes
        return strikes


class _Disturbed(Generic[Out]):
    """A request that may not have left yet, or whose answer may be lost."""

    def __init__(self, clock: Clock, key: str, timeout: float) -> None:
        self.asked: Pending[Out] | None = None
        self.loses_answer = False
        self._clock = clock
        self._deadline = clock.now() + timeout
        self._gone = NoAnswer(f"no answer from {key} within {timeout:g} s")
        self._result: Any = None

    def take(self) -> Out | Refused | NoAnswer | None:
        if self._result is None:
            answer = self.asked.take() if self.asked is not None else None
            if answer is not None and not self.loses_answer:
                self._result = answer
            elif self._clock.now() >= self._deadline:
                self._result = self._gone
        return self._result
