"""``python -m services.page``: one page process."""

import functools
import json
import os
import sys
import threading
from collections.abc import Sequence
from pathlib import Path

import structlog

from services.page import frames
from services.page.assets import load_assets, scene_of
from services.page.config import PageConfig
from services.page.hand import Hand, Reach
from services.page.service import Page
from services.page.tracking import PointerTracker
from services.page.web import Web
from shared.bus.base import Bus
from shared.clock import Clock
from shared.game.rules import RuleBook
from shared.runtime.files import atomic_write
from shared.runtime.serve import ServeArgs, serve
from shared.runtime.service import StatusReporter
from shared.sim.arena import bat_of, target_of
from shared.sim.config import SimConfig
from shared.sim.model import FencingModel

FILE = "page.json"
"""In the run's folder: where the page is."""

log = structlog.get_logger()


def build(args: ServeArgs, bus: Bus, clock: Clock) -> Page:
    """Return the page that the command line asks for; it serves from now on."""
    cfg = args.section("page", PageConfig)
    sim = args.section("sim", SimConfig)
    rules = args.section("game", RuleBook)
    reach = Reach.of(sim.half_distance, target_of(sim))
    hand = Hand(reach, bat_of(sim), cfg.max_speed, cfg.turn_speed)
    tracker = PointerTracker(hand, clock.now())
    web = Web(cfg.host, cfg.port, cfg.origins, load_assets(scene_of(FencingModel.build(sim))))
    try:
        write_place(args.run, web.url)
    except BaseException:
        web.close()
        raise
    log.info("page_served", url=web.url)
    points = {
        "point": rules.point, "penalty": rules.penalty, "camping_award": rules.camping_award,
        "camping_seconds": rules.camping_steps * sim.control_timestep,
    }  # fmt: skip
    seconds = rules.bout_steps * sim.control_timestep
    hello = functools.partial(frames.hello, cfg, bout_seconds=seconds, rules=points)
    return Page(cfg, web, tracker, hello, bus, clock)


def write_place(folder: Path, url: str) -> None:
    """Say in the run's folder where the page is: ``{"url": ..., "pid": ...}``."""
    folder.mkdir(parents=True, exist_ok=True)
    atomic_write(folder / FILE, json.dumps({"url": url, "pid": os.getpid()}).encode())


def run(service: Page, bus: Bus, clock: Clock, args: ServeArgs, stop: threading.Event) -> None:
    """Tick whenever something arrives, and often while somebody plays, until ``stop`` is set."""
    try:
        bus.declare_alive(args.role)
        reporter = StatusReporter(service, bus, clock, args.role)
        while not stop.is_set():
            service.tick()
            reporter.tick()
            bus.wait(service.patience)
    finally:
        (args.run / FILE).unlink(missing_ok=True)


def main(argv: Sequence[str] | None = None) -> int:
    """Serve the page until told to stop; return the exit code."""
    return serve("page", build, argv, loop=run)


if __name__ == "__main__":
    sys.exit(main())
