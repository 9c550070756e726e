"""``python -m services.recorder``: one recorder process."""

import dataclasses
import hashlib
import sys
import threading
from collections.abc import Sequence

from services.recorder.config import RecorderConfig
from services.recorder.live import about_of
from services.recorder.service import Recorder
from shared.bus.base import Bus
from shared.bus.config import BusConfig
from shared.clock import Clock
from shared.errors import ConfigError
from shared.game.rules import RuleBook
from shared.policy.action import ActionConfig
from shared.runtime.process import give_way
from shared.runtime.serve import ServeArgs, open_site_bus, serve
from shared.runtime.service import StatusReporter
from shared.sim.config import SimConfig
from shared.sim.model import FencingModel

PACE = 0.02
"""Seconds from one look at the bus to the next: a live bout says 800 things a second, and to wake
for each would cost more than to record it."""
INBOX_MESSAGES = 512
"""Values of one stream that may wait: five seconds of the 100 Hz loop."""


def build(args: ServeArgs, bus: Bus, clock: Clock) -> Recorder:
    """Return the recorder that the command line asks for."""
    sim = args.section("sim", SimConfig)
    model = FencingModel.build(sim)
    cfg = args.section("recorder", RecorderConfig)
    sections = {
        "game": args.section("game", RuleBook),
        "sim": sim,
        "action": args.section("action", ActionConfig),
    }
    about = about_of(args.run, model, sections, site_hash(args))
    return Recorder(cfg, bus, clock, args.run, model, about)


def site_hash(args: ServeArgs) -> str:
    """Return 64 hex digits that stand for the site file and what was said over it.

    Raises:
        ConfigError: the site file cannot be read.
    """
    try:
        text = args.site.read_bytes() if args.site is not None else b""
    except OSError as error:
        raise ConfigError(f"cannot read {args.site}: {error.strerror or error}") from error
    return hashlib.sha256(b"\n".join([text, *map(str.encode, args.overrides)])).hexdigest()


def open_bus(args: ServeArgs, clock: Clock) -> Bus:
    """Return a session in which streams may wait for longer than in others.

    Its threads wake behind those of the control path: nobody waits for a recorder.
    """
    give_way()
    if args.section("bus", BusConfig).inbox_messages < INBOX_MESSAGES:
        roomy = (*args.overrides, f"bus.inbox_messages={INBOX_MESSAGES}")
        args = dataclasses.replace(args, overrides=roomy)
    return open_site_bus(args, clock)


def run(service: Recorder, bus: Bus, clock: Clock, args: ServeArgs, stop: threading.Event) -> None:
    """Look at the bus at an even pace until ``stop`` is set."""
    bus.declare_alive(args.role)
    reporter = StatusReporter(service, bus, clock, args.role, args.log_path)
    while not stop.wait(PACE):
        bus.wait(0.0)
        service.tick()
        reporter.tick()


def main(argv: Sequence[str] | None = None) -> int:
    """Run the recorder; return its exit code."""
    return serve("recorder", build, argv, open_bus=open_bus, loop=run)


if __name__ == "__main__":
    sys.exit(main())
