"""`riposte study allocate`: draws who meets the conditions in which order, under blind labels."""

import argparse
from collections.abc import Sequence
from pathlib import Path

from shared.clock import SystemClock
from shared.errors import ConfigError
from shared.study.allocation import MAX_PEOPLE, block_size
from shared.study.drawing import draw_orders
from shared.study.folder import ALLOCATION, KEY

LARGEST_SEED = 2**31 - 1


def main(argv: Sequence[str]) -> int:
    """Run ``riposte study allocate``; return the exit code."""
    parser = argparse.ArgumentParser(
        prog="riposte study allocate",
        description=f"{__doc__} Said again with the same seed it adds orders for more people.",
    )
    parser.add_argument("folder", type=Path, metavar="DIR", help="the study's")
    parser.add_argument("--people", type=int, required=True, metavar="N", help="how many orders")
    parser.add_argument(
        "--seed", type=int, required=True, metavar="S",
        help=f"0 to {LARGEST_SEED}; it stands in {KEY} afterwards, for whoever knows it can "
        "tell the conditions",
    )  # fmt: skip
    found = parser.parse_args(argv)
    if not 1 <= found.people <= MAX_PEOPLE:
        raise ConfigError(f"--people is {found.people}; allowed are 1 to {MAX_PEOPLE}")
    if not 0 <= found.seed <= LARGEST_SEED:
        raise ConfigError(f"--seed is {found.seed}; allowed are 0 to {LARGEST_SEED}")
    study = draw_orders(found.folder, found.people, found.seed, SystemClock())
    print(
        f"{study.folder / ALLOCATION}: {len(study.assignments)} orders "
        f"({study.protocol.order.kind}); what the labels mean is in {KEY}"
    )
    block = block_size(study.protocol)
    if len(study.assignments) % block:
        print(f"not balanced: the Williams design is whole with a multiple of {block} people")
    return 0
