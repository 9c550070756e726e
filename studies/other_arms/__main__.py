"""Makes data sets of other arms, or tells what `riposte identify` says of many of them.

``python -m studies.other_arms make OUT --arm six --fault payload --seed 1``;
``python -m studies.other_arms ask --arms six --faults payload none --seeds 1 2``. ``hanging`` and
``hanging_torques`` are another arm with every seed.
"""

import argparse
import multiprocessing
import os
from pathlib import Path

from shared.runtime.process import THREAD_LIMITS
from studies.other_arms.arms import ARMS
from studies.other_arms.asking import asked
from studies.other_arms.drawn import DRAWN, arm_named
from studies.other_arms.faults import ABSORBED, FAULTS
from studies.other_arms.recording import convert


def main() -> None:
    """Make one data set, or ask of many."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=8.0, help="of a recording")
    verbs = parser.add_subparsers(dest="verb", required=True)
    make = verbs.add_parser("make", help="write a data set")
    make.add_argument("out", type=Path, help="the new folder")
    make.add_argument("--arm", choices=(*ARMS, *DRAWN), required=True)
    make.add_argument("--fault", choices=FAULTS, default="none")
    make.add_argument("--seed", type=int, default=0)
    ask = verbs.add_parser("ask", help="make data sets and identify what is wrong")
    ask.add_argument("--arms", nargs="+", choices=(*ARMS, *DRAWN), default=tuple(ARMS))
    ask.add_argument("--faults", nargs="+", choices=FAULTS, default=tuple(FAULTS))
    ask.add_argument("--seeds", nargs="+", type=int, default=(1,))
    ask.add_argument("--processes", type=int, default=2)
    args = parser.parse_args()
    if args.verb == "make":
        print(
            convert(args.out, arm_named(args.arm, args.seed), args.fault, args.seconds, args.seed)
        )
        return
    jobs = [
        (arm, fault, seed, args.seconds)
        for seed in args.seeds
        for fault in args.faults
        for arm in args.arms
        if (arm_named(arm, seed).control, fault) not in ABSORBED
    ]
    os.environ.update(THREAD_LIMITS)
    with multiprocessing.get_context("spawn").Pool(args.processes) as pool:
        for line in pool.imap_unordered(asked, jobs):
            print(line, flush=True)


if __name__ == "__main__":
    main()
