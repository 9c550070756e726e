"""``python -m services.recorder``: one recorder process."""

import sys
from collections.abc import Sequence

from services.recorder.config import RecorderConfig
from services.recorder.service import Recorder
from shared.bus.base import Bus
from shared.clock import Clock
from shared.runtime.serve import ServeArgs, serve
from shared.sim.config import SimConfig
from shared.sim.model import FencingModel


def build(args: ServeArgs, bus: Bus, clock: Clock) -> Recorder:
    """Return the recorder that the command line asks for."""
    model = FencingModel.build(args.section("sim", SimConfig))
    cfg = args.section("recorder", RecorderConfig)
    return Recorder(cfg, bus, clock, args.run, model)


def main(argv: Sequence[str] | None = None) -> int:
    """Run the recorder; return its exit code."""
    return serve("recorder", build, argv)


if __name__ == "__main__":
    sys.exit(main())
