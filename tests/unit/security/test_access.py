"""Who may do what, as Zenoh is told."""

import json
from collections.abc import Iterator

import pytest
import zenoh

from shared.bus.access import access_control, size_limits
from shared.bus.config import BusConfig, client_json, router_json
from shared.bus.keys import matches
from shared.messages.topics import CERTIFIED, SERVICES, TOPICS

LOCKED = BusConfig(
    connect=("tls/10.0.0.1:7447",), listen=("tls/0.0.0.0:7447",), certificates="/certs"
)


def may(role: str, message: str, flow: str) -> Iterator[str]:
    """Yield the keys of a role's rules."""
    control = access_control()
    (policy,) = (one for one in control["policies"] if one["subjects"] == [role])
    for rule in control["rules"]:
        if rule["id"] in policy["rules"] and message in rule["messages"] and flow in rule["flows"]:
            yield from rule["key_exprs"]


def is_allowed(role: str, message: str, key: str) -> bool:
    return any(
        matches(pattern, f"riposte/v1/run/{key}") for pattern in may(role, message, "ingress")
    )


def test_zenoh_takes_both_configurations() -> None:
    zenoh.Config.from_json5(router_json(LOCKED))
    zenoh.Config.from_json5(client_json(LOCKED, "actor"))


def test_everyone_must_show_a_certificate_and_check_the_others_name() -> None:
    for config in (json.loads(router_json(LOCKED)), json.loads(client_json(LOCKED, "actor"))):
        link = config["transport"]["link"]
        assert link["protocols"] == ["tls"]
        assert link["tls"]["enable_mtls"] is True
        assert link["tls"]["verify_name_on_connect"] is True
        assert link["tls"]["close_link_on_expiration"] is True
    assert link["tls"]["connect_private_key"] == "/certs/actor.key"


def test_what_no_rule_allows_is_refused_and_every_role_has_rules_of_its_own() -> None:
    control = access_control()
    assert control["enabled"] is True
    assert control["default_permission"] == "deny"
    assert {rule["permission"] for rule in control["rules"]} == {"allow"}
    assert [one["cert_common_names"] for one in control["subjects"]] == [[r] for r in CERTIFIED]
    ids = [rule["id"] for rule in control["rules"]]
    assert len(set(ids)) == len(ids)
    assert sorted(ids) == sorted(name for one in control["policies"] for name in one["rules"])
    for rule in control["rules"]:
        assert not any("@" in key or key.startswith("*") for key in rule["key_exprs"])


@pytest.mark.parametrize(
    ("role", "message", "key", "allowed"),
    [
        ("robot_io", "put", "play/bats", True),
        ("policy", "put", "play/bats", False),
        ("policy", "put", "play/protagonist/offset", True),
        ("actor", "put", "play/protagonist/offset", False),
        ("page", "query", "play/arm", True),
        ("policy", "query", "play/arm", False),
        ("actor", "query", "learner/antagonist/rollout", True),
        ("actor", "put", "learner/antagonist/policy", False),
        ("actor", "reply", "league/lease", False),
        ("actor", "put", "status/actor/actor-0", True),
        ("actor", "put", "status/league/league-0", False),
        ("robot_io", "put", "status/robot-io/robot-io-0", True),
        ("recorder", "put", "play/bats", False),
        ("recorder", "query", "league/snapshot", False),
        ("metrics", "declare_subscriber", "play/bats", False),
        ("robot_io", "liveliness_token", "alive/robot-io/robot-io-0/b007", True),
        ("actor", "liveliness_token", "alive/referee/actor-0/b007", False),
        ("operator", "liveliness_token", "alive/league/me/b007", False),
    ],
)
def test_roles_have_the_rights_of_the_table(
    role: str, message: str, key: str, allowed: bool
) -> None:
    assert is_allowed(role, message, key) is allowed


def test_nobody_deletes_but_routers() -> None:
    for role in CERTIFIED:
        assert bool(list(may(role, "delete", "ingress"))) is (role == "router")


def test_every_message_of_the_table_has_its_limit_and_no_key_has_two() -> None:
    limits: dict[tuple[str, str], int] = {}
    for limit in size_limits():
        assert limit["flows"] == ["ingress"]
        for message in limit["messages"]:
            for key in limit["key_exprs"]:
                assert (message, key) not in limits
                limits[message, key] = limit["size_limit"]
    assert len(limits) == len(TOPICS) + 2 * len(SERVICES)
    assert limits["put", "riposte/v1/*/play/bats"] == 4096 + 64
    assert limits["query", "riposte/v1/*/learner/*/rollout"] == 8 << 20
    assert limits["reply", "riposte/v1/*/league/lease"] == 16384


def test_a_site_without_certificates_has_no_rules() -> None:
    config = json.loads(router_json(BusConfig()))
    assert "access_control" not in config
    assert "low_pass_filter" not in config
