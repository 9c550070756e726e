"""``python -m services.metrics``: one metrics endpoint."""

import sys
from collections.abc import Sequence

import structlog

from services.metrics.config import MetricsConfig
from services.metrics.service import Metrics
from shared.bus.base import Bus
from shared.clock import Clock
from shared.runtime.serve import ServeArgs, serve

log = structlog.get_logger()


def build(args: ServeArgs, bus: Bus, clock: Clock) -> Metrics:
    """Return the endpoint that the command line asks for; it serves from now on."""
    cfg = args.section("metrics", MetricsConfig)
    made = Metrics(cfg, bus, clock)
    log.info("metrics_served", url=f"http://{cfg.host}:{made.port}/metrics")
    return made


def main(argv: Sequence[str] | None = None) -> int:
    """Serve metrics until told to stop; return the exit code."""
    return serve("metrics", build, argv)


if __name__ == "__main__":
    sys.exit(main())
