"""What Zenoh's own log says of those it refused.

The library tells its caller nothing of refusals, only its log. At the levels below it writes one
line for each refused message, with the identity of the session that sent it, and one for each
refused connection; nothing for what it lets pass, and nothing that was in a message.
"""

import dataclasses
import re
from collections import Counter

LOG_FILTER = ",".join((
    "off",
    "zenoh_link_tls=warn",
    "zenoh_link_quic=warn",
    "zenoh::net::routing::interceptor=trace",
    "zenoh::net::routing::interceptor::access_control=info",
    "zenoh::net::routing::interceptor::low_pass=off",
    "zenoh::net::primitives::demux=trace",  # whose message it is
))  # fmt: skip
"""For ``zenoh.init_log_from_env_or``."""

_COLOUR = re.compile(rb"\x1b\[[0-9;]*m")
_MESSAGE = re.compile(rb"demux\{[^}]*?\bsrc=[^}]*?/([0-9a-f]+)(?::\d+)?\}[^\n]*: Msg intercepted!")
_STRANGER = re.compile(rb"([0-9a-f]+) did not match any configured ACL subject")
_CONNECTION = re.compile(rb"WARN[^\n]*? zenoh_link_(?:tls|quic)[\w:]*: ([^\n]*)")
_HINT = re.compile(r"\.? (Hint: |at /).*")


@dataclasses.dataclass(frozen=True)
class Refusals:
    """What a stretch of the log says."""

    messages: Counter[str]
    """Refused messages, by the beginning of their session's identity."""
    strangers: tuple[str, ...]
    """Sessions whose certificate is of our authority, and of no role."""
    connections: Counter[str]
    """Refused connections, by what was wrong with them."""


def read_log(text: bytes) -> Refusals:
    """Return the refusals in whole lines of the log."""
    plain = _COLOUR.sub(b"", text)
    return Refusals(
        Counter(zid.decode() for zid in _MESSAGE.findall(plain)),
        tuple(zid.decode() for zid in _STRANGER.findall(plain)),
        Counter(
            _HINT.sub("", said.decode("utf-8", "replace")).strip()[:200]
            for said in _CONNECTION.findall(plain)
        ),
    )
