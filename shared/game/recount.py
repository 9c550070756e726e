"""The score of an archived bout, counted again from its bat states by the rule book.

The archive says which ticks the referee judged; where the bats were in those, and the rules, decide
the rest. What comes out must be the referee's score to the last bit.
"""

import numpy as np

from shared.errors import RiposteError
from shared.game.bout import Scoreboard
from shared.game.geometry import BatShape, Target
from shared.game.live import judge_states
from shared.game.rules import RuleBook
from shared.messages.message import Array
from shared.telemetry.archive import ArchivedBout
from shared.telemetry.streams import BATS, REFEREE, TICK


def recount(bout: ArchivedBout, rules: RuleBook, bat: BatShape, target: Target) -> Scoreboard:
    """Return the scoreboard of one bout after its last archived step.

    Args:
        bout: as it was recorded, from its first step on.
        rules: of the bout.
        bat: shape of both bats.
        target: the sphere.

    Raises:
        RiposteError: the archive lacks what was judged; says which tick.
    """
    info = bout.info
    if info.from_step:
        raise RiposteError(
            f"{bout.folder} was recorded from step {info.from_step} on; "
            "a score can only be counted from the start"
        )
    scores = Scoreboard(1, rules, bat, target)
    for states in judged_states(bout):
        judge_states(scores, states[None])
    return scores


def judged_states(bout: ArchivedBout) -> Array:
    """Return float64[K, 2, 13], the states of both bats in each step that was judged, in order.

    Raises:
        RiposteError: the archive lacks what was judged; says which tick.
    """
    rows = bout.streams.get(BATS.name)
    if rows is None:
        raise RiposteError(f"{bout.folder} has no bat states")
    places = {
        tick: k
        for k, (tick, boot) in enumerate(zip(rows[TICK].tolist(), rows["boot"], strict=True))
        if boot == bout.info.robot_io_boot
    }
    ticks = judged_ticks(bout)
    if missing := [tick for tick in ticks if tick not in places]:
        raise RiposteError(
            f"{bout.folder} has no bat states of tick {missing[0]}, which was judged"
        )
    return bout.bats()[[places[tick] for tick in ticks]]


def judged_ticks(bout: ArchivedBout) -> list[int]:
    """Return the ticks whose bat states were judged, in order; one that stood in for others twice.

    Raises:
        RiposteError: so many of the referee's rows were lost that it cannot be told.
    """
    rows = bout.streams.get(REFEREE.name)
    if rows is None:
        raise RiposteError(f"{bout.folder} has no word of the referee")
    own: Array = rows["bout"] == bout.info.bout
    judged: list[int] = []
    before, step, missed = -1, 0, 0
    columns = (rows[name][own].tolist() for name in (TICK, "step", "missed_ticks"))
    for tick, now, missed_now in zip(*columns, strict=True):
        steps, gaps = now - step, missed_now - missed
        if steps > 0:
            judged += _between(bout, before, tick, steps, gaps)
        before, step, missed = tick, now, missed_now
    return judged


def _between(bout: ArchivedBout, before: int, tick: int, steps: int, gaps: int) -> list[int]:
    """Return the ticks judged from one row of the referee to the next."""
    if gaps >= steps:  # the bout ended within the gap
        return [before] * steps
    if gaps == steps - 1:
        return [before] * gaps + [tick]
    if gaps == 0:  # rows of the referee were lost, no tick was
        return np.arange(tick - steps + 1, tick + 1).tolist()
    raise RiposteError(
        f"{bout.folder} lost the referee's rows between ticks {before} and {tick}, "
        "and with them which ticks were judged"
    )
