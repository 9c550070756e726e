"""The topic table against the code: who is given a right uses it, who needs one has it."""

import ast
import functools
from collections.abc import Iterator
from pathlib import Path

from shared.messages import topics
from shared.messages.topics import SERVICES, TOPICS, WATCHERS, Role, Service, Topic
from shared.runtime.serve import role_of

ROOT = Path(__file__).resolve().parents[3]
COMMON = ("shared/runtime/service.py",)
"""What every service runs."""
DOCTOR = "services/jobs/doctor"
"""Plays both sides on a router of its own, which has no rules."""
REHEARSAL = "services/jobs/study/rehearsal"
"""Plays a page's part on a bus in memory."""
ACTS = {"publish", "subscribe", "answer", "ask", "Outbox", "_every"}


@functools.cache
def calls() -> tuple[tuple[ast.Call, str], ...]:
    """Return every call in the services that may be one on the bus, and its file."""
    found: list[tuple[ast.Call, str]] = []
    for path in sorted((ROOT / "services").rglob("*.py")):
        text = path.read_text("utf-8")
        if "shared.messages" in text or ".alive(" in text:
            nodes = ast.walk(ast.parse(text))
            where = str(path.relative_to(ROOT))
            found += [(node, where) for node in nodes if isinstance(node, ast.Call)]
    return tuple(found)


def uses() -> Iterator[tuple[str, str, str]]:
    """Yield act, name of the topic and file of every call on the bus that names its topic."""
    for node, path in calls():
        called = node.func
        act = called.attr if isinstance(called, ast.Attribute) else getattr(called, "id", "")
        if act not in ACTS:
            continue
        for argument in node.args[:2]:
            name = getattr(argument, "attr", "") or getattr(argument, "id", "")
            if isinstance(getattr(topics, name, None), Topic | Service):
                yield act, name, path


def role_in(path: str) -> Role:
    return role_of(path.split("/")[1])


def test_whoever_uses_a_topic_may() -> None:
    others = (DOCTOR, "services/jobs/chaos", REHEARSAL)
    found = [one for one in uses() if not one[2].startswith(others)]
    assert len(found) > 40
    for act, name, path in found:
        entry, role = getattr(topics, name), role_in(path)
        may = {
            "publish": lambda e=entry: e.writers,
            "subscribe": lambda e=entry: e.readers,
            "_every": lambda e=entry: e.readers,
            "ask": lambda e=entry: e.askers,
            "Outbox": lambda e=entry: e.askers,
            "answer": lambda e=entry: (e.answerer,),
        }[act]()
        assert role in may, f"{path} does {act} {name}, and the table does not let {role}"


def test_whoever_may_write_or_answer_does() -> None:
    found = {(act, name, role_in(path)) for act, name, path in uses()}
    names = {id(value): name for name, value in vars(topics).items()}
    for topic in TOPICS:
        for role in topic.writers:
            if "{role}" not in topic.key:  # a status is published for every service alike
                assert ("publish", names[id(topic)], role) in found
    for service in SERVICES:
        assert ("answer", names[id(service)], service.answerer) in found


def test_whoever_looks_for_others_may() -> None:
    found = 0
    for node, path in calls():
        called = node.func
        if isinstance(called, ast.Attribute) and called.attr == "alive":
            watched = [one.value for one in node.args if isinstance(one, ast.Constant)]
            found += len(watched)
            assert all(role_in(path) in WATCHERS[role_of(role)] for role in watched), path
    assert found > 3
