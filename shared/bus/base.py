"""What every bus offers; services are written against this and nothing else.

A service is single-threaded: it takes what has arrived, works, and waits on ``Bus.wait``.
Nothing here blocks except ``Bus.wait``, and that has a deadline. Undecodable input never reaches
a service: it is counted in ``Bus.counters`` (``refused_messages``), and a request is answered
with a refusal that says why.
"""

from collections.abc import Mapping
from typing import Protocol, TypeVar

from shared.messages.message import Message
from shared.messages.topics import Service, Topic

M_co = TypeVar("M_co", bound=Message, covariant=True)
In = TypeVar("In", bound=Message)
In_co = TypeVar("In_co", bound=Message, covariant=True)
Out = TypeVar("Out", bound=Message)
Out_contra = TypeVar("Out_contra", bound=Message, contravariant=True)


class Refused(Message, frozen=True):
    """The other side answered that it will not, and why."""

    reason: str
    retry: bool = False
    """It was only too busy: the same request may be accepted later."""


class NoAnswer(Message, frozen=True):
    """Nobody answered: no answerer on the bus, it died, or the deadline passed."""

    reason: str


class Subscription(Protocol[M_co]):
    """Values of one topic that have arrived and were not taken."""

    @property
    def dropped(self) -> int:
        """Return how many values of a STREAM topic were thrown away because too many waited."""
        ...

    def take(self) -> M_co | None:
        """Return the next value, or None.

        On a LATEST topic the newest value of each key that was not taken yet; a re-sent value
        that was taken before is not returned again. On a STREAM topic the oldest waiting one;
        when too many wait, the oldest are dropped.
        """
        ...

    def close(self) -> None:
        """Stop listening."""
        ...


class Request(Protocol[In_co, Out_contra]):
    """A request that arrived; answer it with ``reply`` or ``refuse``, now or on a later tick.

    A second answer, or one to an asker that has left, is ignored.
    """

    @property
    def message(self) -> In_co:
        """Return what was asked; its arrays are read-only."""
        ...

    def reply(self, message: Out_contra) -> None:
        """Answer."""
        ...

    def refuse(self, reason: str, *, retry: bool = False) -> None:
        """Answer with an error that the asker gets as ``Refused``."""
        ...


class Inbox(Protocol[In_co, Out_contra]):
    """Requests that have arrived, oldest first; bounded: above the bound askers are refused."""

    def take(self) -> Request[In_co, Out_contra] | None:
        """Return the oldest waiting request, or None."""
        ...

    def close(self) -> None:
        """Stop answering."""
        ...


class Pending(Protocol[M_co]):
    """A request under way."""

    def take(self) -> M_co | Refused | NoAnswer | None:
        """Return the answer once it is there, and from then on; None while it may still come."""
        ...


class Bus(Protocol):
    """One process's end of the bus."""

    name: str
    """Of the process, unique in the run: ``actor-0``."""
    boot: str
    """Hex identity of this run of the process."""

    @property
    def counters(self) -> Mapping[str, int]:
        """Return counts since the start; ``shared.bus.counters`` names them."""
        ...

    def publish(self, topic: Topic[Out], message: Out, **fields: str) -> None:
        """Send a value; a LATEST one is re-sent from ``wait`` every second until replaced.

        Raises:
            ValueError: if the message or a field of the key is not what the topic says.
        """
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
        """Wait until something new arrives, at most ``timeout`` seconds; do the upkeep.

        What arrived before the previous call returned does not end the wait, so a service that
        leaves requests in its inbox on purpose does not spin.

        Returns whether something new arrived.

        Raises:
            BusError: the session could not be restored within its limit.
        """
        ...

    def close(self) -> None:
        """Leave the bus; what is asked or published afterwards goes nowhere."""
        ...
