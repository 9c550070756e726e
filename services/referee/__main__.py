"""``python -m services.referee``: one referee process."""

import functools
import sys
from collections.abc import Sequence

from services.referee.config import RefereeConfig
from services.referee.service import Referee
from shared.bus.base import Bus
from shared.clock import Clock
from shared.game.bout import Scoreboard
from shared.game.rules import RuleBook
from shared.runtime.serve import ServeArgs, serve
from shared.sim.arena import bat_of, target_of
from shared.sim.config import SimConfig


def build(args: ServeArgs, bus: Bus, clock: Clock) -> Referee:
    """Return the referee that the command line asks for."""
    sim = args.section("sim", SimConfig)
    rules = args.section("game", RuleBook)
    board = functools.partial(Scoreboard, 1, rules, bat_of(sim), target_of(sim))
    cfg = args.section("referee", RefereeConfig)
    return Referee(cfg, board, sim.control_timestep, bus, clock)


def main(argv: Sequence[str] | None = None) -> int:
    """Run the referee; return its exit code."""
    return serve("referee", build, argv)


if __name__ == "__main__":
    sys.exit(main())
