"""``python -m services.policy --agent protagonist``: one policy process."""

import sys
from collections.abc import Sequence

from services.policy.acting import Acting
from services.policy.config import PolicyConfig
from services.policy.loading import Loader
from services.policy.service import Policy
from shared.bus.base import Bus
from shared.clock import Clock
from shared.errors import ConfigError
from shared.policy.action import ActionConfig
from shared.policy.snapshot import Fit
from shared.runtime.serve import ServeArgs, serve
from shared.sim.arena import arena_of, target_of
from shared.sim.config import SimConfig


def build(args: ServeArgs, bus: Bus, clock: Clock) -> Policy:
    """Return the policy that the command line asks for."""
    if args.agent is None:
        raise ConfigError("which side? give --agent antagonist or --agent protagonist")
    cfg = args.section("policy", PolicyConfig)
    sim = args.section("sim", SimConfig)
    action = args.section("action", ActionConfig)
    fit = Fit.of(action, sim.control_timestep, cfg.model or None)
    loader = Loader(args.agent, fit, arena_of(sim, action), args.run)
    acting = Acting(args.agent, target_of(sim), action, cfg.seed)
    return Policy(cfg, args.agent, loader.load, acting, bus, clock)


def main(argv: Sequence[str] | None = None) -> int:
    """Run the policy; return its exit code."""
    return serve("policy", build, argv)


if __name__ == "__main__":
    sys.exit(main())
