"""The topic table as a list of acts, for the tests: made without the code they test."""

from shared.messages.topics import ROLES, SERVICES, TOPICS, WATCHERS, Role, key_role


def allowed(role: Role) -> set[tuple[str, str, str]]:
    """Return what the topic table lets a role do."""
    made: set[tuple[str, str, str]] = set()
    for topic in TOPICS:
        for other in ROLES if "{role}" in topic.key else ROLES[:1]:
            key = topic.key.format(role=key_role(other), name="someone", agent="antagonist")
            if role in topic.writers and ("{role}" not in topic.key or other == role):
                made.add(("publish", role, key))
            if role in topic.readers:
                made.add(("subscribe", role, key))
    for service in SERVICES:
        key = service.key.format(agent="antagonist")
        if role in service.askers:
            made.add(("ask", role, key))
        if role == service.answerer:
            made.add(("answer", role, key))
    made.add(("appear", role, f"alive/{key_role(role)}/{role}/boot"))
    made |= {
        ("watch", role, f"alive/{key_role(seen)}/x/boot")
        for seen, watchers in WATCHERS.items()
        if role in watchers
    }
    return made
