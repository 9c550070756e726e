"""The players that a protocol names, each loaded once to see that it is there and fits."""

from collections.abc import Sequence
from pathlib import Path

from services.jobs.play.plan import RUNS
from services.jobs.play.seats import Seat, seat_of
from services.policy.config import PolicyConfig
from services.policy.loading import Loader
from shared.config.site import load_section
from shared.errors import SnapshotError
from shared.policy.action import ActionConfig
from shared.policy.snapshot import Fit
from shared.sim.arena import arena_of
from shared.sim.config import SimConfig
from shared.study.protocol import Protocol


def seats_of(
    protocol: Protocol, site: Path | None, overrides: Sequence[str] = ()
) -> dict[str, Seat]:
    """Return whom each name of a player in a protocol means.

    Args:
        protocol: names the players.
        site: site file; None means the defaults.
        overrides: over the site file.

    Raises:
        ConfigError: the site file is no good.
        SnapshotError: a player is not there or does not fit: names where the protocol says it.
    """
    sim = load_section(site, "sim", SimConfig, overrides)
    action = load_section(site, "action", ActionConfig, overrides)
    policy = load_section(site, "policy", PolicyConfig, overrides)
    fit = Fit.of(action, sim.control_timestep, policy.model or None)
    loader = Loader("protagonist", fit, arena_of(sim, action), Path())
    named = {f"condition {each.name!r}": each.player for each in protocol.condition}
    if protocol.warm_up is not None:
        named["warm_up"] = protocol.warm_up.player
    seats: dict[str, Seat] = {}
    for where, player in named.items():
        if player in seats:
            continue
        try:
            seats[player] = seat_of(player, loader, RUNS)
        except SnapshotError as error:
            raise SnapshotError(f"{where}: player {player!r}: {error}") from None
    return seats
