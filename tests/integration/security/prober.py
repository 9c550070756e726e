"""Tries everything with the certificate of each role, and says what got through.

A process: ``prober.py ENDPOINT CERTIFICATES ROLE...`` prints a JSON list of [verb, role, key].
On the other side of everything is one witness, who has the router's certificate and may do all.
"""

import json
import sys
import time
from collections.abc import Callable, Iterable
from typing import Any

import zenoh

from shared.bus.config import BusConfig, client_json
from shared.bus.keys import PREFIX
from shared.messages.topics import ROLES, SERVICES, TOPICS, Role, key_role
from tests.integration.security.allowed import allowed

RUN = f"{PREFIX}/probe"
ARRIVE_SECONDS = 20.0
"""What is allowed gets through within this, on however busy a machine."""
AGAIN_SECONDS = 0.5
"""When nothing new came for so long, everything is said again."""
SETTLE_SECONDS = 0.5
"""How much longer than the last allowed message a forbidden one may take."""
WIDE = ("**", "riposte/**", f"{RUN}/**", f"{RUN}/play/**", "riposte/*/*/play/bats", "@/**")


class Prober:
    """Sessions of some roles, and of the witness."""

    def __init__(self, endpoint: str, certificates: str, roles: Iterable[Role]) -> None:
        cfg = BusConfig(connect=(endpoint,), certificates=certificates)
        self.got: set[tuple[str, str, str]] = set()
        self.kept: list[Any] = []
        self.witness = open_as(cfg, "router")
        self.roles = {role: open_as(cfg, role) for role in roles}

    def publish(self) -> None:
        """Everyone puts and deletes everything."""

        def hear(it: zenoh.Sample) -> None:
            verb = "publish" if it.kind == zenoh.SampleKind.PUT else "delete"
            self._note(verb, it.attachment.to_string() if it.attachment else "", str(it.key_expr))

        def act() -> None:
            for role, session in self.roles.items():
                own = f"{RUN}/alive/{key_role(role)}/x/y"
                for key in [*keys(), f"{RUN}/anything", own, "else"]:
                    session.put(key, "put", attachment=role)
                    session.delete(key, attachment=role)

        self.kept.append(self.witness.declare_subscriber(f"{PREFIX}/**", hear))
        self._until("publish", act)

    def subscribe(self) -> None:
        """Everyone listens to everything, in narrow words and in wide ones."""

        def act() -> None:
            for key in [*keys(), f"{RUN}/anything"]:
                self.witness.put(key, "news")

        for role, session in self.roles.items():

            def hear(it: zenoh.Sample, role: Role = role) -> None:
                self._note("subscribe", role, str(it.key_expr))

            patterns = [*(f"{RUN}/{stars(topic.key)}" for topic in TOPICS), *WIDE]
            self.kept += [session.declare_subscriber(pattern, hear) for pattern in patterns]
        self._until("subscribe", act)

    def ask(self) -> None:
        """Everyone asks everything; the witness answers."""

        def act() -> None:
            for role, session in self.roles.items():

                def hear(reply: zenoh.Reply, role: Role = role) -> None:
                    self._note("ask", role, str(reply.ok.key_expr))  # type: ignore[union-attr]

                for key in [*service_keys(), f"{RUN}/anything", f"{RUN}/**"]:
                    get(session, key, hear)

        self.kept += [
            self.witness.declare_queryable(
                key, lambda query: query.reply(query.key_expr, "yes"), complete=True
            )
            for key in [*service_keys(), f"{RUN}/anything"]
        ]
        self._until("ask", act)

    def answer(self) -> None:
        """Everyone answers everything; the witness asks."""

        def hear(reply: zenoh.Reply) -> None:
            sample = reply.ok
            self._note("answer", sample.payload.to_string(), str(sample.key_expr))  # type: ignore[union-attr]

        def act() -> None:
            for key in [*service_keys(), f"{RUN}/anything"]:
                get(self.witness, key, hear)

        for role, session in self.roles.items():

            def say(query: zenoh.Query, role: Role = role) -> None:
                query.reply(query.key_expr, role)

            self.kept += [
                session.declare_queryable(key, say, complete=True)
                for key in [*service_keys(), f"{RUN}/anything", f"{RUN}/**"]
            ]
        self._until("answer", act)

    def appear(self) -> None:
        """Everyone claims to be everybody."""

        def hear(it: zenoh.Sample) -> None:
            key = str(it.key_expr)
            self._note("appear", key.split("/")[5], key)

        # with history: the router may hear of a role's token before it hears of the subscriber
        everybody = self.witness.liveliness().declare_subscriber(f"{PREFIX}/**", hear, history=True)
        self.kept.append(everybody)
        for role, session in self.roles.items():
            self.kept += [
                session.liveliness().declare_token(f"{RUN}/alive/{key_role(other)}/{role}/boot")
                for other in ROLES
            ]
        self._until("appear", lambda: None)

    def watch(self) -> None:
        """Everyone looks for everybody, each role alone and all at once."""
        self.kept += [
            self.witness.liveliness().declare_token(f"{RUN}/alive/{key_role(other)}/x/boot")
            for other in ROLES
        ]
        for role, session in self.roles.items():

            def hear(it: zenoh.Sample, role: Role = role) -> None:
                self._note("watch", role, str(it.key_expr))

            alive = f"{RUN}/alive"
            patterns = [*(f"{alive}/{key_role(other)}/*/*" for other in ROLES), f"{alive}/**"]
            self.kept += [
                session.liveliness().declare_subscriber(pattern, hear, history=True)
                for pattern in patterns
            ]
        self._until("watch", lambda: None)

    def close(self) -> None:
        for session in (*self.roles.values(), self.witness):
            session.close()

    def _note(self, verb: str, role: str, key: str) -> None:
        self.got.add((verb, role, key.removeprefix(f"{RUN}/")))

    def _until(self, verb: str, act: Callable[[], None]) -> None:
        """Act until what is allowed got through, and see what else did."""
        want = {one for role in self.roles for one in allowed(role) if one[0] == verb}
        deadline = time.monotonic() + ARRIVE_SECONDS
        while time.monotonic() < deadline:
            act()
            again = time.monotonic() + AGAIN_SECONDS
            while time.monotonic() < again and not want <= self.got:
                time.sleep(0.02)
            if want <= self.got:
                break
        time.sleep(SETTLE_SECONDS)
        for entity in self.kept:
            entity.undeclare()
        self.kept.clear()


def open_as(cfg: BusConfig, role: str) -> zenoh.Session:
    config = zenoh.Config.from_json5(client_json(cfg, role))  # type: ignore[arg-type]
    deadline = time.monotonic() + ARRIVE_SECONDS
    while True:
        try:
            return zenoh.open(config)
        except zenoh.ZError:
            if time.monotonic() > deadline:
                raise


def get(session: zenoh.Session, key: str, hear: Callable[[zenoh.Reply], None]) -> None:
    session.get(
        key, lambda reply: hear(reply) if reply.ok else None, timeout=5.0,
        target=zenoh.QueryTarget.ALL, consolidation=zenoh.ConsolidationMode.NONE,
    )  # fmt: skip


def keys() -> list[str]:
    """Return a key of every topic; that of a status once for every role."""
    return [
        f"{RUN}/{topic.key.format(role=key_role(role), name='someone', agent='antagonist')}"
        for topic in TOPICS
        for role in (ROLES if "{role}" in topic.key else ROLES[:1])
    ]


def service_keys() -> list[str]:
    return [f"{RUN}/{service.key.format(agent='antagonist')}" for service in SERVICES]


def stars(template: str) -> str:
    return template.format(role="*", name="*", agent="*")


def main() -> None:
    """Run once."""
    endpoint, certificates, *roles = sys.argv[1:]
    prober = Prober(endpoint, certificates, [role for role in ROLES if role in roles])
    prober.publish()
    prober.subscribe()
    prober.ask()
    prober.answer()
    prober.appear()
    prober.watch()
    prober.close()
    sys.stdout.write(json.dumps(sorted(prober.got)))


if __name__ == "__main__":
    main()
