"""``python -m services.league SITE.toml --run DIR``: the league process of one run."""

import sys
from collections.abc import Sequence

from services.league.config import LeagueConfig
from services.league.service import League
from services.league.settings import run_settings
from shared.bus.base import Bus
from shared.clock import Clock
from shared.game.rules import RuleBook
from shared.runtime.serve import ServeArgs, serve


def build(args: ServeArgs, bus: Bus, clock: Clock) -> League:
    """Return the league of the run in ``args.run``."""
    cfg = args.section("league", LeagueConfig)
    rules = args.section("game", RuleBook)
    settings = run_settings(args.site, args.overrides)
    return League(
        cfg, bus, clock, args.run, args.run_id, cfg.seed, False, rules=rules, settings=settings
    )


def main(argv: Sequence[str] | None = None) -> int:
    """Run the league; return its exit code."""
    return serve("league", build, argv)


if __name__ == "__main__":
    sys.exit(main())
