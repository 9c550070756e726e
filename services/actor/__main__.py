"""``python -m services.actor``: one actor process."""

import sys
from collections.abc import Sequence

from services.actor.config import ActorConfig
from services.actor.service import Actor
from shared.bus.base import Bus
from shared.clock import Clock
from shared.errors import ConfigError
from shared.game.reward import RewardConfig
from shared.game.rules import RuleBook
from shared.policy.action import ActionConfig
from shared.policy.snapshot import Fit
from shared.runtime.serve import ServeArgs, serve
from shared.sim.config import SimConfig
from shared.sim.env import FencingEnv
from shared.sim.model import FencingModel


def build(args: ServeArgs, bus: Bus, clock: Clock) -> Actor:
    """Return the actor that the command line asks for."""
    cfg = args.section("actor", ActorConfig)
    action = args.section("action", ActionConfig)
    model = FencingModel.build(args.section("sim", SimConfig))
    env = FencingEnv(model, args.section("game", RuleBook), action, cfg.num_envs)
    fit = Fit.of(action, model.cfg.control_timestep, model.hash)
    try:
        return Actor(cfg, args.section("reward", RewardConfig), env, fit, bus, clock)
    except ValueError as error:
        raise ConfigError(f"[actor] {error}") from None


def main(argv: Sequence[str] | None = None) -> int:
    """Run the actor; return its exit code."""
    return serve("actor", build, argv)


if __name__ == "__main__":
    sys.exit(main())
