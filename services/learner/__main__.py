"""``python -m services.learner``: the learner of one agent."""

import sys
from collections.abc import Sequence

# First, before anything imports the compiler.
import services.learner.uncompiled  # noqa: F401 # pyright: ignore[reportUnusedImport]
from services.learner.config import LearnerConfig
from services.learner.service import Learner, RunFacts
from shared.bus.base import Bus
from shared.clock import Clock
from shared.errors import ConfigError
from shared.game.rules import RuleBook
from shared.policy.action import ActionConfig
from shared.policy.snapshot import Fit
from shared.runtime.serve import ServeArgs, serve
from shared.sim.config import SimConfig
from shared.sim.model import FencingModel


def build(args: ServeArgs, bus: Bus, clock: Clock) -> Learner:
    """Return the learner that the command line asks for.

    Raises:
        ConfigError: it does not say whose learner this is.
    """
    if args.agent is None:
        raise ConfigError("a learner needs --agent antagonist or --agent protagonist")
    cfg = args.section("learner", LearnerConfig)
    model = FencingModel.build(args.section("sim", SimConfig))
    action = args.section("action", ActionConfig)
    facts = RunFacts(
        run=args.run_id,
        seed=cfg.seed,
        fit=Fit.of(action, model.cfg.control_timestep, model.hash),
        rules=args.section("game", RuleBook),
    )
    return Learner(cfg, args.agent, facts, args.run / "learner" / args.agent, bus, clock)


def main(argv: Sequence[str] | None = None) -> int:
    """Run the learner; return its exit code."""
    return serve("learner", build, argv)


if __name__ == "__main__":
    sys.exit(main())
