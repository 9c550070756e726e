"""Words for people that several reports need."""

from collections.abc import Sequence

THOUSANDTHS = {"s": "ms", "m": "mm", "rad": "mrad"}
"""Units whose thousandths have a name of their own."""


def listing(names: Sequence[str]) -> str:
    """Return names as in a sentence: ``a, b and c``."""
    return " and ".join([", ".join(names[:-1]), names[-1]]) if len(names) > 1 else "".join(names)


def scaled(unit: str, *values: float) -> tuple[str, float]:
    """Return a unit that fits the largest of values, and what to multiply them by; not ``1``."""
    largest = max((abs(value) for value in values), default=0.0)
    if unit in THOUSANDTHS and 0.0 < largest < 0.1:
        return THOUSANDTHS[unit], 1e3
    return ("" if unit == "1" else unit), 1.0
