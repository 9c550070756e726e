"""Words for people that several reports need."""

from collections.abc import Sequence

THOUSANDTHS = {"s": "ms", "m": "mm", "rad": "mrad"}
"""Units of what joints and trackers say whose thousandths have a name of their own."""
_SMALLER = {**THOUSANDTHS, "kg": "g"}
"""All of those."""


def listing(names: Sequence[str]) -> str:
    """Return names as in a sentence: ``a, b and c``."""
    return " and ".join([", ".join(names[:-1]), names[-1]]) if len(names) > 1 else "".join(names)


def scaled(unit: str, *values: float) -> tuple[str, float]:
    """Return a unit that fits the largest of values, and what to multiply them by.

    ``rad/(N m)`` may become ``mrad/(N m)``; ``1`` is a share, so percent.
    """
    if unit == "1":
        return "%", 100.0
    of, per, rest = unit.partition("/")
    largest = max((abs(value) for value in values), default=0.0)
    if of in _SMALLER and 0.0 < largest < 0.1:
        return f"{_SMALLER[of]}{per}{rest}", 1e3
    return unit, 1.0
