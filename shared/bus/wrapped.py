"""A bus around another one, for what does something with a process's traffic on its way."""

from collections.abc import Mapping
from typing import TypeVar

from shared.bus.base import Bus, Inbox, Pending, Subscription
from shared.messages.message import Message
from shared.messages.topics import Service, Topic

In = TypeVar("In", bound=Message)
Out = TypeVar("Out", bound=Message)


class WrappedBus:
    """Passes everything on; a subclass changes what it is there for."""

    def __init__(self, bus: Bus) -> None:
        self.name = bus.name
        self.boot = bus.boot
        self._bus = bus

    @property
    def counters(self) -> Mapping[str, int]:
        """Return the wrapped bus's counts."""
        return self._bus.counters

    def publish(self, topic: Topic[Out], message: Out, **fields: str) -> None:
        """Send a value."""
        self._bus.publish(topic, message, **fields)

    def subscribe(self, topic: Topic[Out], **fields: str) -> Subscription[Out]:
        """Listen."""
        return self._bus.subscribe(topic, **fields)

    def answer(self, service: Service[In, Out], **fields: str) -> Inbox[In, Out]:
        """Offer a service."""
        return self._bus.answer(service, **fields)

    def ask(
        self, service: Service[In, Out], message: In, timeout: float, **fields: str
    ) -> Pending[Out]:
        """Send a request."""
        return self._bus.ask(service, message, timeout, **fields)

    def declare_alive(self, role: str) -> None:
        """Let others see this process."""
        self._bus.declare_alive(role)

    def alive(self, role: str) -> frozenset[str]:
        """Return who is alive."""
        return self._bus.alive(role)

    def wait(self, timeout: float) -> bool:
        """Wait until something new arrives, at most ``timeout`` seconds."""
        return self._bus.wait(timeout)

    def close(self) -> None:
        """Leave the bus."""
        self._bus.close()
