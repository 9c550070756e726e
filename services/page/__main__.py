"""``python -m services.page``: one page process."""

import contextlib
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
from shared.clock import Clock, SystemClock
from shared.game.rules import RuleBook
from shared.runtime.files import atomic_write
from shared.runtime.serve import ServeArgs, open_site_bus, serve_plain
from shared.runtime.service import StatusReporter
from shared.sim.arena import bat_of, target_of
from shared.sim.config import SimConfig
from shared.sim.model import FencingModel

ROLE = "page"
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


def run(service: Page, bus: Bus, clock: Clock, stop: threading.Event) -> None:
    """Tick whenever something arrives, and often while somebody plays, until ``stop`` is set."""
    bus.declare_alive(ROLE)
    reporter = StatusReporter(service, bus, clock, ROLE)
    while not stop.is_set():
        service.tick()
        reporter.tick()
        bus.wait(service.patience)


def main(argv: Sequence[str] | None = None) -> int:
    """Serve the page until told to stop; return the exit code."""
    clock = SystemClock()

    def body(args: ServeArgs, stop: threading.Event) -> None:
        with (
            contextlib.closing(open_site_bus(args, clock)) as bus,
            contextlib.closing(build(args, bus, clock)) as service,
        ):
            log.info("service_started", pid=os.getpid(), boot=bus.boot)
            try:
                run(service, bus, clock, stop)
            finally:
                (args.run / FILE).unlink(missing_ok=True)

    return serve_plain(ROLE, body, argv)


if __name__ == "__main__":
    sys.exit(main())
