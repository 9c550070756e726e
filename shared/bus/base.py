"""What every bus offers; services are written against this and nothing else.

A service is single-threaded: it takes what has arrived, works, and waits on ``Bus.wait``.
Nothing here blocks except ``Bus.wait``, and that has a deadline. Undecodable input never reaches
a service: it is counted in ``Bus.counters`` (``refused_messages``), and a request is answered
with a refusal that says why.
"""

from collections.abc import Mapping
from typing import Generic, Protocol, TypeVar

from shared.messages.message import Message
from shared.messages.topics import Service, Topic

M = TypeVar("M", bound=Message, covariant=True)
Out = TypeVar("Out", bound=Message)
In = TypeVar("In", bound=Message)


class Subscription(Protocol[M]):
    """Values of one topic that have arrived and were not taken."""

    def take(self) -> M | None:
        """Return the next value, or None.

        On a LATEST topic the newest value of each key that was not taken yet; a re-sent value
        that was taken before is not returned again. On a STREAM topic the oldest waiting one.
        """
        ...

    def close(self) -> None:
        """Stop listening."""
        ...


class Request(Generic[In, Out]):
    """A request that arrived; answer it with ``reply`` or ``refuse``, now or on a later tick."""

    message: In

    def reply(self, message: Out) -> None:
        """Answer. A second answer, or one to an asker that has left, is ignored."""
        raise NotImplementedError

    def refuse(self, reason: str) -> None:
        """Answer with an error that the asker gets as ``Refused``."""
        raise NotImplementedError


class Inbox(Protocol[In, Out]):
    """Requests that have arrived, oldest first; bounded: above the bound askers are refused."""

    def take(self) -> Request[In, Out] | None:
        """Return the oldest waiting request, or None."""
        ...

    def close(self) -> None:
        """Stop answering."""
        ...


class Pending(Protocol[M]):
    """A request under way."""

    def take(self) -> "M | Refused | NoAnswer | None":
        """Return the answer once it is there, None while it may still come."""
        ...


class Refused(Message, frozen=True):
    """The other side answered that it will not, and why."""

    reason: str


class NoAnswer(Message, frozen=True):
    """Nobody answered: no answerer on the bus, it died, or the deadline passed."""

    reason: str


class Bus(Protocol):
    """One process's end of the bus."""

    name: str
    """Of the process, unique in the run: ``actor-0``."""
    boot: str
    """Hex identity of this run of the process."""

    @property
    def counters(self) -> Mapping[str, int]:
        """Return counts since the start: bytes and messages in and out, refusals, reconnects."""
        ...

    def publish(self, topic: Topic[Out], message: Out, **fields: str) -> None:
        """Send a value; a LATEST one is re-sent from ``wait`` every second until replaced."""
        ...

    def subscribe(self, topic: Topic[Out], **fields: str) -> Subscription[Out]:
        """Listen; a field left out matches any value."""
        ...

    def answer(self, service: Service[In, Out], **fields: str) -> Inbox[In, Out]:
        """Offer a service."""
        ...

    def ask(
        self, service: Service[In, Out], message: In, timeout: float, **fields: str
    ) -> Pending[Out]:
        """Send a request; the answer is taken from what this returns, within ``timeout`` s."""
        ...

    def declare_alive(self, role: str) -> None:
        """Let others see this process for as long as it lives."""
        ...

    def alive(self, role: str) -> frozenset[str]:
        """Return the names of the processes of a role that are alive (a refresh may lag 1 s)."""
        ...

    def wait(self, timeout: float) -> bool:
        """Wait until something can be taken, at most ``timeout`` seconds; do the upkeep.

        Returns whether anything can be taken.

        Raises:
            BusError: the session could not be restored within its limit.
        """
        ...

    def close(self) -> None:
        """Leave the bus."""
        ...
