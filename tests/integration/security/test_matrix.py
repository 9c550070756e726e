"""Every role, topic and verb, on real TLS sessions: what the topic table says, and no more."""

import json
import os
import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path

import pytest

from shared.messages.topics import ROLES, Role
from tests.integration.security.allowed import allowed
from tests.integration.security.locked import ROOT, Locked

pytestmark = pytest.mark.zenoh


def probed(endpoint: str, certificates: Path, roles: Iterable[str]) -> set[tuple[str, str, str]]:
    """Return what got through."""
    done = subprocess.run(
        [
            sys.executable, str(Path(__file__).with_name("prober.py")),
            endpoint, str(certificates), *roles,
        ],
        cwd=ROOT, env=os.environ | {"PYTHONPATH": str(ROOT)}, capture_output=True, text=True,
        timeout=100,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return {tuple(found) for found in json.loads(done.stdout)}


def expected(roles: Iterable[Role]) -> set[tuple[str, str, str]]:
    """Return what should."""
    return set[tuple[str, str, str]]().union(*map(allowed, roles))


def check(site: Locked, roles: tuple[Role, ...]) -> None:
    got, want = probed(site.endpoint, site.certificates, roles), expected(roles)
    assert sorted(got - want) == []
    assert sorted(want - got) == []
    for role in roles:
        assert site.await_event("messages_refused", role=role)["count"] > 0
    # what the site is about, said once more without the table
    commands = {role for verb, role, key in got if verb == "publish" and key.endswith("/offset")}
    assert commands <= {"policy", "operator"}
    for verb, role, key in got:
        assert verb != "delete"
        if verb == "publish" and key in ("play/bats", "play/arms", "play/robot", "play/gate"):
            assert role == "robot_io"
        if (verb, key) == ("ask", "play/arm"):
            assert role in ("page", "study", "operator")


def test_an_actor_and_a_policy_may_do_what_the_table_says_and_no_more(site: Locked) -> None:
    check(site, ("actor", "policy"))


@pytest.mark.slow
def test_every_role_may_do_what_the_table_says_and_no_more(site: Locked) -> None:
    check(site, ROLES)


def test_the_list_of_verbs_above_is_complete() -> None:
    seen = {verb for role in ROLES for verb, _, _ in allowed(role)}
    assert seen == {"publish", "subscribe", "ask", "answer", "appear", "watch"}
