"""``python -m services.policy --agent protagonist``: one policy process."""

import sys
from collections.abc import Sequence

import msgspec

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


class _Players(msgspec.Struct, frozen=True):
    """What the sections of the page and the study have in common."""

    players: tuple[tuple[str, str], ...] = ()


def build(args: ServeArgs, bus: Bus, clock: Clock) -> Policy:
    """Return the policy that the command line asks for."""
    if args.agent is None:
        raise ConfigError("which side? give --agent antagonist or --agent protagonist")
    cfg = args.section("policy", PolicyConfig)
    sim = args.section("sim", SimConfig)
    action = args.section("action", ActionConfig)
    fit = Fit.of(action, sim.control_timestep, cfg.model or None)
    loader = Loader(args.agent, fit, arena_of(sim, action), args.run, listed(args, cfg))
    acting = Acting(args.agent, target_of(sim), action, cfg.seed)
    return Policy(cfg, args.agent, loader, acting, bus, clock)


def listed(args: ServeArgs, cfg: PolicyConfig) -> frozenset[str]:
    """Return the players that this process's settings name, for itself, the page and the study."""
    pairs = (args.section(name, _Players).players for name in ("page", "study"))
    asked = (player for players in pairs for _, player in players)
    return frozenset((cfg.antagonist, cfg.protagonist, *asked))


def main(argv: Sequence[str] | None = None) -> int:
    """Run the policy; return its exit code."""
    return serve("policy", build, argv)


if __name__ == "__main__":
    sys.exit(main())
