"""What a fault is, and how long to wait for what it struck."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Generic, TypeVar

import numpy as np

SITE = TypeVar("SITE")

UP_SECONDS = 300.0
"""Longest wait for a process to come up again."""


@dataclass(frozen=True)
class Chance:
    """What an injection may choose, and for how long it goes on."""

    generator: np.random.Generator
    stop_seconds: float = 30.0
    """Of SIGSTOP."""

    def one_of(self, names: tuple[str, ...]) -> str:
        """Return one of them."""
        return names[int(self.generator.integers(len(names)))]


@dataclass(frozen=True)
class Blow:
    """A fault that was injected."""

    victim: str
    struck_at: float
    """By the job's clock (s)."""
    over_at: float
    """When it was over: the rest is the system's own (s)."""
    back_at: float | None
    """When what was struck was up again (s); None where it was not."""
    note: str = ""
    told: dict[str, int] = field(default_factory=dict[str, int])
    refused: dict[str, int] = field(default_factory=dict[str, int])


@dataclass(frozen=True)
class Fault(Generic[SITE]):
    """Something that goes wrong, by name."""

    name: str
    what: str
    """What is done."""
    strikes: str
    """Whom it can strike."""
    strike: Callable[[SITE, Chance], Blow]
    seconds: float = 0.0
    """How long it goes on (s), to know whether a run is long enough."""
