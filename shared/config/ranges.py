"""Ranges of settings, checked where a section is made."""


def check_range(name: str, value: float, low: float, high: float) -> None:
    """Refuse a value that is out of its range, or not a number.

    Raises:
        ValueError: says which setting, its value, and what is allowed.
    """
    if not low <= value <= high:  # also refuses NaN
        said = value if isinstance(value, int) else f"{value:g}"
        raise ValueError(f"{name} is {said}; allowed are {low:g} to {high:g}")


def check_ranges(section: object, *ranges: tuple[str, float, float]) -> None:
    """Refuse a section in which a value is out of its range.

    Args:
        section: holds the values as attributes.
        ranges: name, smallest and largest value of each.

    Raises:
        ValueError: as :func:`check_range`.
    """
    for name, low, high in ranges:
        check_range(name, getattr(section, name), low, high)


def check_ordered(section: object, *pairs: tuple[str, str]) -> None:
    """Refuse a section in which the first value of a pair is above the second.

    Args:
        section: holds the values as attributes.
        pairs: names of both.

    Raises:
        ValueError: says which settings, and their values.
    """
    for first, second in pairs:
        low, high = getattr(section, first), getattr(section, second)
        if low > high:
            raise ValueError(f"{first} ({low:g}) must not be above {second} ({high:g})")
