"""Keys on the bus, from the templates of the topic table."""

import functools
import re
import string

PREFIX = "riposte/v1"
"""How every key on the bus begins; the name of the run is next."""

_CHUNK = re.compile(r"[A-Za-z0-9._-]{1,255}")


def key_of(template: str, fields: dict[str, str]) -> str:
    """Return the key of a template such as ``learner/{agent}/rollout``.

    Raises:
        ValueError: if a field is missing, unknown, or not one plain chunk of a key.
    """
    missing = fields_of(template) - fields.keys()
    if missing:
        raise ValueError(f"key {template} needs {', '.join(sorted(missing))}")
    return pattern_of(template, fields)


def pattern_of(template: str, fields: dict[str, str]) -> str:
    """Return the key with ``*`` for every field left out.

    Raises:
        ValueError: if a field is unknown, or not one plain chunk of a key.
    """
    names = fields_of(template)
    unknown = fields.keys() - names
    if unknown:
        raise ValueError(f"key {template} has no field {', '.join(sorted(unknown))}")
    for name, value in fields.items():
        check_chunk(name, value)
    return template.format(**{name: fields.get(name, "*") for name in names})


def fields_of(template: str) -> set[str]:
    """Return the names of a template's fields."""
    return {name for _, name, _, _ in string.Formatter().parse(template) if name}


@functools.lru_cache(maxsize=4096)
def fields_in(template: str, key: str) -> dict[str, str]:
    """Return what a key has in the place of each field of its template; nothing where none fits.

    Args:
        template: such as ``learner/{agent}/rollout``.
        key: the whole one, which begins with what the template leaves out.
    """
    want = template.split("/")
    have = key.split("/")[-len(want) :]
    return {
        chunk[1:-1]: value
        for chunk, value in zip(want, have, strict=False)
        if chunk.startswith("{") and chunk.endswith("}")
    }


def is_chunk(text: str) -> bool:
    """Return whether a text can be one chunk of a key of ours."""
    return _CHUNK.fullmatch(text) is not None


def check_chunk(what: str, value: str) -> None:
    """Refuse a text that cannot be one chunk of a key.

    Raises:
        ValueError: naming the value.
    """
    if not is_chunk(value):
        raise ValueError(f"{what} {value!r} must be 1 to 255 letters, digits, '.', '_' or '-'")


@functools.lru_cache(maxsize=4096)
def matches(pattern: str, key: str) -> bool:
    """Return whether a key matches a pattern with ``*`` for whole chunks."""
    want, have = pattern.split("/"), key.split("/")
    return len(want) == len(have) and all(w in ("*", h) for w, h in zip(want, have, strict=True))
