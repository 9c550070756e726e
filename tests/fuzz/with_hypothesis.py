"""Hypothesis at the dice of our mutators: it looks for the extremes of every choice."""

from collections.abc import Callable
from random import Random

from hypothesis import HealthCheck, Phase, given, seed, settings
from hypothesis import strategies as st

from tests.fuzz.order import Order
from tests.fuzz.target import Target

ROUND = 500
"""Inputs between two new beginnings: what hypothesis remembers of a round takes memory."""


def run(targets: list[Target], read: Callable[[int, bytes, int], None], order: Order) -> None:
    """Read as many inputs as the order says.

    Args:
        targets: of the group.
        read: reads an input of a target; the last argument is the order's first number.
        order: of the parent.
    """
    count = 0

    def read_one(random: Random, which: int) -> None:
        nonlocal count
        if count < order.count:
            target = targets[which]
            data = target.mutate(random, random.choice(target.samples))
            read(which, data, order.first)
            count += 1

    chosen = [which for which, each in enumerate(targets) for _ in range(each.weight)]
    dice = given(random=st.randoms(use_true_random=False), which=st.sampled_from(chosen))
    number = 0
    while count < order.count:
        before = count
        how = settings(
            max_examples=min(ROUND, order.count - count), deadline=None, database=None,
            phases=[Phase.generate], suppress_health_check=list(HealthCheck),
        )  # fmt: skip
        seed(f"{order.seed}/{order.first}/{number}")(how(dice(read_one)))()
        number += 1
        if count == before:
            raise RuntimeError(f"hypothesis made no input of {order.group} in {ROUND} tries")
