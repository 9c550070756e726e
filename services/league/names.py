"""Names of messages, ``boot:sequence``: every one is kept, most of them as part of a range."""

import re
from collections.abc import Iterator

from shared.bus.ranges import Ranges

_NAME = re.compile(r"(.*):(0|[1-9][0-9]{0,17})", re.DOTALL | re.ASCII)


class Names:
    """A set of names that grows with the boots and the gaps in their numbers, not with the names.

    A name of another form is kept as it is.
    """

    __slots__ = ("_boots", "_others", "_size")

    def __init__(self) -> None:
        self._boots: dict[str, Ranges] = {}
        self._others: set[str] = set()
        self._size = 0

    def __len__(self) -> int:
        return self._size

    def __iter__(self) -> Iterator[str]:
        for boot, ranges in self._boots.items():
            for first, last in ranges:
                yield from (f"{boot}:{number}" for number in range(first, last + 1))
        yield from self._others

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Names):
            return NotImplemented
        return self._boots == other._boots and self._others == other._others

    __hash__ = None  # pyright: ignore[reportAssignmentType] - it changes

    def __contains__(self, name: str) -> bool:
        found = _NAME.fullmatch(name)
        if found is None:
            return name in self._others
        ranges = self._boots.get(found[1])
        return ranges is not None and int(found[2]) in ranges

    def spans(self) -> Iterator[str]:
        """Yield ``boot:first-last`` for each range; names of another form are left out."""
        for boot, ranges in self._boots.items():
            yield from (f"{boot}:{first}-{last}" for first, last in ranges)

    def add(self, name: str) -> bool:
        """Enter a name; return whether it was not there before."""
        if name in self:
            return False
        self._size += 1
        found = _NAME.fullmatch(name)
        if found is None:
            self._others.add(name)
        else:
            self._boots.setdefault(found[1], Ranges()).add(int(found[2]))
        return True
