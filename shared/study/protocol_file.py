"""Reads a protocol from its TOML file; what is wrong is named with file, line and field."""

from collections import Counter
from collections.abc import Iterator, Sequence
from importlib import resources
from pathlib import Path
from typing import Final

from shared.config.located import Key, Problem, read_toml, sentence
from shared.config.site import nearest
from shared.errors import ConfigError
from shared.study.protocol import ITEM_ID, LANGUAGE, NAME, ONE_LINE, Instrument, Protocol

SHIPPED: Final = ("study-one", "study-two", "template")
"""Names of the protocols that come with the program."""

PATTERNS: Final = {
    NAME: "up to 40 small letters, digits and hyphens",
    ITEM_ID: "up to 40 letters, digits, hyphens and underscores",
    ONE_LINE: "one line without tabs",
    LANGUAGE: "a language such as en or de-CH",
}
"""What the patterns of a protocol and of a key ask for, in words."""


def load_protocol(path: Path) -> Protocol:
    """Return the protocol that a file holds.

    Raises:
        ConfigError: it cannot be read, or a value is unknown, missing, of the wrong type,
            impossible, or names something that is not there: says file, line and field.
    """
    try:
        data = path.read_bytes()
    except OSError as error:
        raise ConfigError(f"cannot read protocol {path}: {error.strerror or error}") from error
    return read_protocol(data, str(path))


def read_protocol(data: bytes, name: str) -> Protocol:
    """Return the protocol in the bytes of a file.

    Args:
        data: the file's bytes.
        name: of the file, for messages.

    Raises:
        ConfigError: as ``load_protocol``.
    """
    protocol = read_toml(data, name, Protocol, PATTERNS)
    for problem in problems_of(protocol):
        raise ConfigError(sentence(name, data.decode(), problem))
    return protocol


def shipped_protocol(name: str) -> Path:
    """Return the file of a protocol that comes with the program.

    Raises:
        ConfigError: there is none of this name.
    """
    if name not in SHIPPED:
        raise ConfigError(f"there is no protocol {name!r}; {nearest(name, SHIPPED)}")
    return Path(str(resources.files("shared.study") / "protocols" / f"{name}.toml"))


def problems_of(protocol: Protocol) -> Iterator[Problem]:
    """Yield what does not go together in a protocol, in the order of its tables."""
    conditions = [each.name for each in protocol.condition]
    instruments = [each.name for each in protocol.instrument]
    yield from _doubled("baseline", [each.name for each in protocol.baseline])
    yield from _doubled("condition", conditions)
    yield from _doubled("instrument", instruments)
    yield from _order(protocol, conditions)
    if len(protocol.section) != len(conditions):
        yield Problem(
            ("section",),
            f"there are {len(protocol.section)} sections and {len(conditions)} conditions: "
            "each section plays one condition, so write as many",
        )
    for index, section in enumerate(protocol.section):
        yield from _asked(protocol, ("section", index), section.instruments, index + 1)
    yield from _asked(protocol, ("start",), protocol.start.instruments, 0)
    yield from _asked(protocol, ("end",), protocol.end.instruments, len(protocol.section))
    for index, instrument in enumerate(protocol.instrument):
        yield from _instrument(("instrument", index), instrument)


def _order(protocol: Protocol, conditions: Sequence[str]) -> Iterator[Problem]:
    first = protocol.order.first
    keys = ("order", "first")
    for name in first:
        if name not in conditions:
            yield Problem(keys, f"there is no condition {name!r}; {nearest(name, conditions)}")
    if len(set(first)) < len(first):
        yield Problem(keys, "a condition stands here twice")
    free = len(conditions) - len(first)
    if protocol.order.kind == "fixed" and first:
        yield Problem(keys, 'goes with kind = "random" or "williams": all of a fixed order stays')
    elif protocol.order.kind != "fixed" and free < 2:
        yield Problem(
            ("order", "kind"),
            f"{protocol.order.kind!r} needs at least 2 conditions to order, and there "
            f"{'is' if free == 1 else 'are'} {max(free, 0)}: add conditions, or say 'fixed'",
        )


def _asked(
    protocol: Protocol, keys: tuple[Key, ...], names: Sequence[str], finished: int
) -> Iterator[Problem]:
    keys = (*keys, "instruments")
    if len(set(names)) < len(names):
        yield Problem(keys, "an instrument stands here twice")
    known = {each.name: each for each in protocol.instrument}
    for name in names:
        if name not in known:
            yield Problem(keys, f"there is no instrument {name!r}; {nearest(name, known)}")
        elif known[name].is_ranking and finished < 2:
            yield Problem(
                keys,
                f"{name!r} ranks the finished sections, and here there are {finished}: "
                "ask it after the second section or later",
            )


def _instrument(keys: tuple[Key, ...], instrument: Instrument) -> Iterator[Problem]:
    items = instrument.item
    ids = [item.id for item in items]
    points = [item.scale for item in items if isinstance(item.scale, int)]
    if instrument.is_ranking and instrument.is_paged:
        yield Problem((*keys, "is_paged"), "a ranking stands on one page")
    for index, item in enumerate(items):
        if item.id in ids[:index]:
            yield Problem((*keys, "item", index, "id"), f"{item.id!r} stands here twice")
        if (item.scale == "ranking") != instrument.is_ranking:
            yield Problem(
                (*keys, "item", index, "scale"),
                "rankings and other questions must be two instruments",
            )
        if isinstance(item.scale, int) and item.scale != points[0]:
            yield Problem(
                (*keys, "item", index, "scale"),
                f"{item.id!r} has {item.scale} points, and the first of {instrument.name!r} "
                f"{points[0]}: scales of other lengths must be another instrument",
            )
        if isinstance(item.scale, int) and len(instrument.labels) not in (0, item.scale):
            yield Problem(
                (*keys, "labels"),
                f"there are {len(instrument.labels)} labels, and item {item.id!r} has "
                f"{item.scale} points",
            )


def _doubled(table: str, names: Sequence[str]) -> Iterator[Problem]:
    for name, count in Counter(names).items():
        if count > 1:
            second = [index for index, each in enumerate(names) if each == name][1]
            yield Problem((table, second, "name"), f"{name!r} stands here twice")
