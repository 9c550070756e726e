"""Which run is on at a bus, for whoever was not told."""

import contextlib
from typing import Any

from shared.bus.config import BusConfig
from shared.bus.zenoh import open_zenoh
from shared.clock import Clock
from shared.errors import ConfigError
from shared.messages.topics import Role, Topic


def find_run(
    cfg: BusConfig, name: str, clock: Clock, role: Role, topic: Topic[Any], seconds: float
) -> str:
    """Return the one run that says something of a topic within so many seconds; empty if none.

    Args:
        cfg: where the routers are.
        name: of this process.
        clock: a clock that moves by itself.
        role: whose certificate the process shows.
        topic: one that every run says something of, and that this role may hear.
        seconds: how long to listen.

    Raises:
        BusError: no router answered.
        ConfigError: several runs are on; as ``open_zenoh``.
    """
    with contextlib.closing(open_zenoh(cfg, name, clock, "any", role)) as bus:
        runs = sorted(bus.runs(topic, seconds))
    if len(runs) > 1:
        raise ConfigError(
            f"{len(runs)} runs are on at {', '.join(cfg.routers)}: {', '.join(runs)}; "
            f"choose one, as in --run-id {runs[0]}"
        )
    return runs[0] if runs else ""
