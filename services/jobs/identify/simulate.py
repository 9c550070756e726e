"""Write a data set of a simulated robot with something wrong about it, to try identification on.

Noise, slow drift, disturbances, a spread of all parameters and a finer time step come with it.
What was hidden is in ``truth.toml`` beside the data, which identification never reads.
"""

import argparse
import re
from pathlib import Path

from shared.errors import ConfigError, IdentificationError
from shared.identification.hidden.generator import hide
from shared.identification.hidden.recipe import Recipe, wish_of
from shared.identification.hidden.truth import HiddenEffect, read_truth
from shared.sim.hidden.arms import ARMS
from shared.sim.hidden.effect import hidden_effects

_SPLIT = re.compile(r"(?P<train>\d{1,3})\+(?P<test>\d{1,3})\Z")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add what ``riposte identify simulate`` is told."""
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.epilog = "effects:\n" + "\n".join(
        f"  {name:<20} hidden by: {each.way}" for name, each in hidden_effects().items()
    )
    parser.add_argument("out", type=Path, metavar="OUT", help="new folder for the data set")
    parser.add_argument(
        "--arm", choices=tuple(ARMS), default="pr2",
        help="pr2: pose control; arm3: three position servos; torque2: two motors (%(default)s)",
    )  # fmt: skip
    parser.add_argument(
        "--effect", action="append", default=[], metavar="NAME[@PLACE][=SIZE]", dest="effects",
        help="hide this; place and size are drawn where they are not said; may be repeated",
    )  # fmt: skip
    parser.add_argument(
        "--random", type=int, metavar="K", help="hide K effects drawn at random (1)"
    )
    parser.add_argument("--null", action="store_true", help="hide nothing")
    parser.add_argument(
        "--imperfect", action="store_true", help="links weigh up to 10 %% more or less, too"
    )
    parser.add_argument(
        "--gentle", action="store_true", help="slow motion by hand, not motion that was designed"
    )
    parser.add_argument(
        "--reach", type=float, default=1.0, metavar="R",
        help="how far motion goes, of what the arm may: 0.08 stays near one posture (%(default)s)",
    )  # fmt: skip
    parser.add_argument("--no-tracker", action="store_true", help="log joints only")
    parser.add_argument(
        "--seed", type=int, default=0, metavar="S", help="of everything random (%(default)s)"
    )
    parser.add_argument(
        "--seconds", type=float, default=6.0, metavar="T", help="of each recording (%(default)s)"
    )
    parser.add_argument(
        "--trajectories", default="3+2", metavar="N+M",
        help="recordings to fit to + held out; the first is made twice on top (%(default)s)",
    )  # fmt: skip
    parser.add_argument("--tell", action="store_true", help="print what was hidden")


def run(arguments: argparse.Namespace) -> int:
    """Write the data set; return the exit code.

    Raises:
        IdentificationError: something cannot be hidden there, or the folder cannot be written.
        ConfigError: options contradict each other.
    """
    out: Path = arguments.out
    dataset = hide(out, _recipe(arguments))
    kinds = [f"{each.name} ({each.split})" for each in dataset.trajectories]
    print(f"wrote {out}: {len(kinds)} recordings of {arguments.arm}, {', '.join(kinds)}")
    if arguments.tell:
        truth = read_truth(out)
        print("\n".join(map(_told, truth.effect)) or "nothing is hidden in it")
    print(f"next: riposte identify {out}")
    return 0


def _recipe(arguments: argparse.Namespace) -> Recipe:
    wishes = tuple(wish_of(text) for text in arguments.effects)
    random: int | None = arguments.random
    if arguments.null and (wishes or random):
        raise ConfigError("--null hides nothing: leave --effect and --random out")
    if random is None:
        random = 0 if arguments.null or wishes else 1
    split = _SPLIT.match(arguments.trajectories)
    if split is None:
        raise IdentificationError(
            f"--trajectories is {arguments.trajectories!r}, expected N+M, as 3+2: "
            "recordings to fit to, and held out"
        )
    return Recipe(
        arm=arguments.arm,
        wishes=wishes,
        random=random,
        is_imperfect=arguments.imperfect,
        is_gentle=arguments.gentle,
        has_tracker=not arguments.no_tracker,
        seed=arguments.seed,
        reach=arguments.reach,
        seconds=arguments.seconds,
        train=int(split["train"]),
        test=int(split["test"]),
    )


def _told(effect: HiddenEffect) -> str:
    place = f" at {effect.where}" if effect.where else ""
    numbers = ", ".join(f"{each.name} {each.value:.4g} {each.unit}" for each in effect.quantities)
    shows = "" if effect.share is None else f"; makes {effect.share:.0%} of the residual"
    return f"hidden: {effect.name}{place}: {numbers} (by {effect.way}){shows}"
