"""Who may do what on the bus, in Zenoh's words: the topic table, and nothing beyond it.

A router decides by the common name of a process's certificate, which is its role. A publisher's
message passes two gates, *ingress* where it enters a router and *egress* where it leaves it for a
reader, and a request and its answer are messages of their own, so that each right below is a few
kinds of message on either side. What no rule allows is refused: other keys, administration
(``@/**``), deleting, and subscriptions wider than a topic (``**``).
"""

import dataclasses
from collections.abc import Iterable, Iterator
from typing import Any

from shared.bus.keys import PREFIX, pattern_of
from shared.bus.latest import MAX_STAMP
from shared.messages.topics import (
    CERTIFIED,
    ROLES,
    SERVICES,
    TOPICS,
    WATCHERS,
    Role,
    key_role,
)

RUNS = f"{PREFIX}/*"
"""Every run; a certificate is good for all runs of its site."""

INGRESS, EGRESS = "ingress", "egress"


@dataclasses.dataclass(frozen=True)
class Verb:
    """Something a process does, and the messages it takes."""

    name: str
    says: tuple[str, ...]
    """What comes from the process."""
    hears: tuple[str, ...]
    """What goes to it."""


PUBLISH = Verb("publish", ("put",), ("declare_subscriber",))
SUBSCRIBE = Verb("subscribe", ("declare_subscriber",), ("put",))
ASK = Verb("ask", ("query",), ("reply", "declare_queryable"))
ANSWER = Verb("answer", ("declare_queryable", "reply"), ("query",))
APPEAR = Verb("appear", ("liveliness_token",), ())
WATCH = Verb("watch", ("declare_liveliness_subscriber", "liveliness_query"), ("liveliness_token",))
VERBS = (PUBLISH, SUBSCRIBE, ASK, ANSWER, APPEAR, WATCH)
EVERYTHING = (
    "put", "delete", "declare_subscriber", "query", "reply", "declare_queryable",
    "liveliness_token", "declare_liveliness_subscriber", "liveliness_query",
)  # fmt: skip
"""What routers say to each other."""


def rights(role: Role) -> Iterator[tuple[Verb, str]]:
    """Yield what a role may do, and on which keys of a run."""
    own = {"role": key_role(role)}
    for topic in TOPICS:
        if role in topic.writers:
            yield PUBLISH, pattern_of(topic.key, own if "{role}" in topic.key else {})
        if role in topic.readers:
            yield SUBSCRIBE, pattern_of(topic.key, {})
    for service in SERVICES:
        if role in service.askers:
            yield ASK, pattern_of(service.key, {})
        if role == service.answerer:
            yield ANSWER, pattern_of(service.key, {})
    yield APPEAR, f"alive/{key_role(role)}/*/*"
    for watched, watchers in WATCHERS.items():
        if role in watchers:
            yield WATCH, f"alive/{key_role(watched)}/*/*"


def access_control() -> dict[str, Any]:
    """Return Zenoh's ``access_control``."""
    rules = [rule for role in ROLES for rule in _rules(role)]
    rules.append(_rule("router", EVERYTHING, (INGRESS, EGRESS), [f"{PREFIX}/**"]))
    return {
        "enabled": True,
        "default_permission": "deny",
        "rules": rules,
        "subjects": [{"id": role, "cert_common_names": [role]} for role in CERTIFIED],
        "policies": [
            {
                "rules": [rule["id"] for rule in rules if rule["id"].split(" ")[0] == role],
                "subjects": [role],
            }
            for role in CERTIFIED
        ],
    }


def size_limits() -> list[dict[str, Any]]:
    """Return Zenoh's ``low_pass_filter``: nothing longer than its topic allows enters a router."""
    limits: dict[tuple[str, int], list[str]] = {}

    def limit(message: str, size: int, key: str) -> None:
        limits.setdefault((message, size), []).append(f"{RUNS}/{pattern_of(key, {})}")

    for topic in TOPICS:
        limit("put", topic.max_bytes + MAX_STAMP, topic.key)
    for service in SERVICES:
        limit("query", service.max_bytes, service.key)
        limit("reply", service.max_reply_bytes, service.key)
    return [
        {
            "id": f"{message} {size}",
            "flows": [INGRESS],
            "messages": [message],
            "key_exprs": sorted(keys),
            "size_limit": size,
        }
        for (message, size), keys in sorted(limits.items())
    ]


def _rules(role: Role) -> Iterator[dict[str, Any]]:
    """Yield the rules of a role: two for each verb."""
    have = list(rights(role))
    for verb in VERBS:
        keys = [f"{RUNS}/{key}" for which, key in have if which is verb]
        if not keys:
            continue
        yield _rule(f"{role} {verb.name} in", verb.says, (INGRESS,), keys)
        if verb.hears:
            yield _rule(f"{role} {verb.name} out", verb.hears, (EGRESS,), keys)


def _rule(
    name: str, messages: Iterable[str], flows: Iterable[str], keys: Iterable[str]
) -> dict[str, Any]:
    return {
        "id": name,
        "messages": list(messages),
        "flows": list(flows),
        "permission": "allow",
        "key_exprs": list(keys),
    }
