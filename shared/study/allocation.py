"""Who meets the conditions in which order: drawn before the study, from a seed, under blind labels.

Williams designs: E. J. Williams, *Experimental designs balanced for the estimation of residual
effects of treatments*, Aust. J. Sci. Res. A 2:149 (1949).
"""

import string
from collections.abc import Iterator, Sequence
from typing import Final, NamedTuple

import numpy as np

from shared.study.protocol import Protocol

LABELS: Final = string.ascii_uppercase
MAX_PEOPLE: Final = 9999


class Assignment(NamedTuple):
    """The order of one participant."""

    participant: str
    """``sub-01``."""
    order: tuple[str, ...]
    """Labels of the conditions, first section first."""


class Allocation(NamedTuple):
    """What is drawn for a study."""

    labels: dict[str, str]
    """Label -> name of the condition, by label."""
    assignments: tuple[Assignment, ...]


def participant_name(number: int) -> str:
    """Return the pseudonymous id of the n-th participant, from 1."""
    return f"sub-{number:02d}"


def allocate(protocol: Protocol, people: int, seed: int) -> Allocation:
    """Return labels and orders; the same for the same seed, and more people change no one's.

    Args:
        protocol: says the conditions, and how they are ordered.
        people: how many participants.
        seed: of all draws, 0 or more.

    Raises:
        ValueError: ``people`` or ``seed`` is out of range.
    """
    if not 1 <= people <= MAX_PEOPLE:
        raise ValueError(f"people ({people}) must be in 1 .. {MAX_PEOPLE}")
    if seed < 0:
        raise ValueError(f"seed ({seed}) must not be negative")
    names = [condition.name for condition in protocol.condition]
    rng = np.random.default_rng(seed)
    labels = {LABELS[index]: names[place] for index, place in enumerate(_shuffled(len(names), rng))}
    label_of = {name: label for label, name in labels.items()}
    orders = _orders(protocol, names, rng)
    assignments = tuple(
        Assignment(participant_name(number), tuple(label_of[name] for name in next(orders)))
        for number in range(1, people + 1)
    )
    return Allocation(labels, assignments)


def block_size(protocol: Protocol) -> int:
    """Return how many people make orders balanced; a multiple does, too. 1 where none are."""
    if protocol.order.kind != "williams":
        return 1
    return len(williams(len(protocol.condition) - len(protocol.order.first)))


def williams(n: int) -> tuple[tuple[int, ...], ...]:
    """Return a Williams design: orders of ``0 .. n - 1``, n of them where n is even, 2 n where odd.

    Each number stands on each place equally often, and each ordered pair of different numbers
    follows each other equally often: once in a design of n orders, twice in one of 2 n.
    """
    if n < 1:
        raise ValueError(f"a design needs at least one condition, not {n}")
    # 0, 1, n - 1, 2, n - 2, ...: the differences of neighbours are all different.
    first = [0, *((step + 1) // 2 if step % 2 else n - step // 2 for step in range(1, n))]
    rows = tuple(tuple((value + shift) % n for value in first) for shift in range(n))
    if n == 1 or n % 2 == 0:
        return rows
    return (*rows, *(row[::-1] for row in rows))


def _orders(
    protocol: Protocol, names: Sequence[str], rng: np.random.Generator
) -> Iterator[tuple[str, ...]]:
    """Yield one order after the other, without end."""
    order = protocol.order
    free = [name for name in names if name not in order.first]
    while True:
        if order.kind == "fixed":
            yield tuple(names)
        elif order.kind == "random":
            yield (*order.first, *(free[index] for index in _shuffled(len(free), rng)))
        else:
            design = williams(len(free))
            symbols = _shuffled(len(free), rng)
            for row in _shuffled(len(design), rng):
                yield (*order.first, *(free[symbols[value]] for value in design[row]))


def _shuffled(count: int, rng: np.random.Generator) -> list[int]:
    return [int(index) for index in rng.permutation(count)]
