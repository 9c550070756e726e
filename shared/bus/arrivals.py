"""What a network library hands over, checked for length before it is copied."""

import contextlib
from typing import Any, Protocol

from shared.bus.base import Refused
from shared.bus.endpoints import MAX_REFUSAL, Answer, ReplyPath, Requests, Values, too_long
from shared.bus.latest import MAX_STAMP, read_stamp
from shared.errors import MessageError
from shared.messages.wire import decode


class Payload(Protocol):
    """Bytes that the library still owns."""

    def __len__(self) -> int:
        """Return how many there are."""
        ...

    def to_bytes(self) -> bytes:
        """Return a copy."""
        ...


def take_value(values: Values[Any], key: str, payload: Payload, stamp: Payload | None) -> None:
    """Put a published value into a subscription.

    Raises:
        MessageError: it is too long, or has no stamp.
    """
    size = len(payload)
    if size > values.max_bytes:
        raise MessageError(too_long(size, key, values.max_bytes))
    if stamp is None or len(stamp) > MAX_STAMP:
        raise MessageError(f"a value on {key} has no stamp, expected boot:count")
    boot, count = read_stamp(stamp.to_bytes())
    values.offer(key, boot, count, payload.to_bytes())


def take_request(inbox: Requests[Any, Any], payload: Payload | None, back: ReplyPath) -> None:
    """Put a request into an inbox, or refuse it."""
    if inbox.accepts(0 if payload is None else len(payload), back):
        inbox.offer(b"" if payload is None else payload.to_bytes(), back)


def take_answer(answer: Answer[Any], ok: Payload | None, error: Payload | None) -> None:
    """Give an answer or a refusal to the one who asked.

    The library's own errors, such as a timeout, are no refusals: the end that follows tells.
    """
    if ok is not None:
        if len(ok) <= answer.max_bytes:
            answer.on_arrival(ok.to_bytes())
        else:
            answer.on_arrival(Refused(f"the answer is {len(ok)} B, over {answer.max_bytes} B"))
    elif error is not None and len(error) <= MAX_REFUSAL:
        with contextlib.suppress(MessageError):
            answer.on_arrival(decode(Refused, error.to_bytes(), MAX_REFUSAL))
