"""How people moved: the eight features of the human's bat in each archived game."""

import dataclasses
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from shared.errors import RiposteError
from shared.game.recount import judged_states
from shared.messages.training import AGENTS
from shared.study.analysis.games import Games
from shared.study.recorded import bout_folder
from shared.styles.features import FEATURES, StyleMeter
from shared.telemetry.archive import ArchivedBout, load_bout

Floats = NDArray[np.float64]
HUMAN = AGENTS.index("antagonist")


@dataclasses.dataclass(frozen=True)
class Moves:
    """Features of a study's games."""

    features: Floats | None
    """float64[n, S, G, 8]; NaN where a game has no archive; None where none has."""
    reason: str = ""
    """Why there are none."""
    note: str = ""
    """What was left out, and why."""


def moves_of(folder: Path, games: Games) -> Moves:
    """Return the features of every game that counts and was archived.

    Args:
        folder: the study's.
        games: its games.
    """
    features = np.full((*games.by_section.shape, len(FEATURES)), np.nan)
    problems: list[str] = []
    absent = 0
    for (person, section, game), (session, bout) in games.bouts.items():
        path = bout_folder(folder / games.people[person] / f"ses-{session:02d}", bout)
        if not bout or not path.is_dir():
            absent += 1
            continue
        try:
            features[person, section, game] = bout_features(load_bout(path))
        except RiposteError as error:
            problems.append(str(error))
    read = len(games.bouts) - absent - len(problems)
    note = f"{absent} games have no archive." if absent else ""
    if problems:
        note = f"{note} {len(problems)} archives cannot be used, the first: {problems[0]}.".strip()
    if not read:
        reason = f"no archived game in the study folder ({note.removesuffix('.') or 'no games'})"
        return Moves(None, reason, note)
    return Moves(features, "", note)


def bout_features(bout: ArchivedBout) -> Floats:
    """Return float64[8], the features of the human's bat over the steps that were judged.

    Raises:
        RiposteError: the archive lacks what was judged, or is too short for a jerk.
    """
    bats = judged_states(bout)
    if len(bats) < 3:
        raise RiposteError(f"{bout.folder} has {len(bats)} judged steps, its jerk needs 3")
    meter = StyleMeter(1, bout.info.control_timestep)
    for bat in bats:  # [2, 13] -> [3, 2, 1]: x y z, side, one bout
        meter.add(bat[:, 0:3].T[:, :, None], bat[:, 7:10].T[:, :, None])
    return meter.features()[0, HUMAN].astype(np.float64)
