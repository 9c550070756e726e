"""`riposte study power`: how many people a difference of learning needs, from a study's scatter."""

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import Final

import msgspec
import numpy as np

from shared.errors import ConfigError
from shared.study.analysis.games import games_of
from shared.study.analysis.power import plan
from shared.study.people.chapter import PAPER_EFFECT, PILOT, TRIED, power_words
from shared.study.tables import load_study

MAX_DRAWS: Final = 100_000


def main(argv: Sequence[str]) -> int:
    """Run ``riposte study power``; return the exit code."""
    found = _parse(argv)
    if not 1 <= found.draws <= MAX_DRAWS:
        raise ConfigError(f"--draws is {found.draws}; allowed are 1 to {MAX_DRAWS}")
    games = games_of(load_study(found.folder, unblind=found.unblind))
    names = tuple(found.conditions.split(",")) if found.conditions else games.conditions
    if len(names) != 2 or not set(names) <= set(games.conditions):
        raise ConfigError(
            f"--conditions {','.join(names)}: two of {', '.join(games.conditions)} are compared, "
            "the one that is to be learned faster first"
        )
    first, second = (games.by_condition[:, games.conditions.index(name)] for name in names)
    whole = np.isfinite(first).all(axis=1) & np.isfinite(second).all(axis=1)
    planned = plan(
        games.numbers, first[whole], second[whole], found.effect, TRIED, found.draws,
        np.random.default_rng(found.seed),
    )  # fmt: skip
    if found.json:
        print(msgspec.json.encode(planned).decode())
        return 0
    print(f"{'people':>7} {'power':>7}   95 %")
    for each in planned.curve:
        power = each.power
        low, high = power.low or 0.0, power.high or 1.0
        mark = "  <- enough" if each.people == planned.needed else ""
        print(f"{each.people:>7} {power.value:>7.3f}   {low:.3f} to {high:.3f}{mark}")
    print(f"\n{power_words(planned, names[0])}\n{PILOT}")
    return 0


def _parse(argv: Sequence[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="riposte study power", description=__doc__,
        epilog="A study of the same kind is drawn again and again, with the effect put in.",
    )  # fmt: skip
    parser.add_argument("folder", type=Path, metavar="DIR", help="a study with games: a pilot")
    parser.add_argument(
        "--effect", type=float, default=PAPER_EFFECT, metavar="POINTS",
        help=f"difference of slopes, points a game (the paper's, {PAPER_EFFECT:.1f})",
    )  # fmt: skip
    parser.add_argument(
        "--conditions", metavar="A,B", help="two of them, as the tables call them (if there are "
        "two: both)",
    )  # fmt: skip
    parser.add_argument("--draws", type=int, default=2000, metavar="N", help="studies a number")
    parser.add_argument("--seed", type=int, default=0, metavar="S", help="of the draws")
    parser.add_argument(
        "--unblind", action="store_true", help="conditions by name, by key.toml; else by label"
    )
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    return parser.parse_args(argv)
