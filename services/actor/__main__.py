"""``python -m services.actor``: one actor process.

With ``--run DIR`` it belongs to the run in that folder; without, it joins the run that is on at its
bus, from whatever machine.
"""

import sys
from collections.abc import Sequence

import structlog

from services.actor import joining
from services.actor.config import ActorConfig
from services.actor.service import Actor
from shared.bus.base import Bus
from shared.clock import Clock, SystemClock
from shared.errors import BusError, ConfigError, RiposteError
from shared.game.reward import RewardConfig
from shared.game.rules import RuleBook
from shared.policy.action import ActionConfig
from shared.policy.snapshot import Fit
from shared.runtime.serve import EXIT_BAD_INPUT, EXIT_BUS_LOST, ServeArgs, serve
from shared.sim.config import SimConfig
from shared.sim.env import FencingEnv
from shared.sim.model import FencingModel
from shared.sim.worlds import worlds_of

log = structlog.get_logger()


def build(args: ServeArgs, bus: Bus, clock: Clock) -> Actor:
    """Return the actor that the command line asks for."""
    cfg = args.section("actor", ActorConfig)
    action = args.section("action", ActionConfig)
    model = FencingModel.build(args.section("sim", SimConfig))
    if cfg.backend == "warp":
        log.info("loading_kernels", hint="compiled the first time on a machine: about a minute")
    worlds = worlds_of(cfg.backend, model, cfg.num_envs, cfg.device)
    env = FencingEnv(model, args.section("game", RuleBook), action, cfg.num_envs, worlds=worlds)
    fit = Fit.of(action, model.cfg.control_timestep, model.hash)
    try:
        return Actor(cfg, args.section("reward", RewardConfig), env, fit, bus, clock)
    except ValueError as error:
        raise ConfigError(f"[actor] {error}") from None


def main(argv: Sequence[str] | None = None) -> int:
    """Run the actor; return its exit code."""
    words = sys.argv[1:] if argv is None else argv
    if not joining.is_joining(words):
        return serve("actor", build, words)
    try:
        joined = joining.join(words, SystemClock())
    except RiposteError as error:
        sys.stderr.write(f"riposte: actor: {error}\n")
        return EXIT_BUS_LOST if isinstance(error, BusError) else EXIT_BAD_INPUT
    if joined is None:
        return 0
    code = serve("actor", build, joined.argv, loop=joining.play_until_finished)
    if code == 0:
        joined.leave()
    return code


if __name__ == "__main__":
    sys.exit(main())
