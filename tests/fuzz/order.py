"""What the parent of a campaign tells a child."""

from typing import Literal

import msgspec

Engine = Literal["mutate", "hypothesis", "atheris"]
"""Who throws the dice for our mutators: a seeded generator, hypothesis, or coverage."""


class Order(msgspec.Struct, frozen=True, kw_only=True):
    """What a child is to do."""

    group: str
    only: str = ""
    """Name of a target; empty: all of the group."""
    engine: Engine = "mutate"
    seed: int
    first: int
    """Of the inputs of the whole group."""
    count: int
    box: str
    result: str
    registry: str = "tests.fuzz.registry"
