"""kill -9 of the league in the middle of phase two."""

import contextlib
from pathlib import Path

import numpy as np
import pytest

from shared.errors import ConfigError, LedgerError
from tests.integration.training.killing import (
    IN_TURN,
    assert_nothing_lost_nor_counted_twice,
    assert_report_lists,
    kill_in_turn,
)
from tests.integration.training.rounds import assert_rounds_are_whole
from tests.integration.training.training import (
    SMALL,
    finish,
    processes_of,
    state_of,
    training,
    wait_until,
)

pytestmark = [pytest.mark.chaos, pytest.mark.zenoh, pytest.mark.timeout(500)]

ITERATIONS, UPDATES = 16, 3
ROUNDS = (
    *SMALL,
    "train.record=false",
    "train.actors=2",
    "league.rounds=2",
    f"league.round_iterations={ITERATIONS}",
    f"league.round_antagonist_updates={UPDATES}",
    f"league.round_protagonist_updates={UPDATES}",
)
VICTIMS = ("league-0", "league-0", IN_TURN, "league-0", "league-0")
"""A process that dies five times within seconds of its start is given up."""


def in_rounds(folder: Path) -> bool:
    with contextlib.suppress(ConfigError, LedgerError):  # not there yet, or just being made
        return any(record.stage.round for record in state_of(folder).stages)
    return False


@pytest.mark.parametrize("seed", range(2))
def test_a_league_killed_in_phase_two_loses_nothing_and_counts_nothing_twice(
    tmp_path: Path, seed: int
) -> None:
    folder = tmp_path / "run"
    generator = np.random.default_rng(seed)
    with training(folder, overrides=(*ROUNDS, f"train.seed={seed}")) as process:
        wait_until(lambda: in_rounds(folder), process, 200)
        killed = kill_in_turn(folder, process, VICTIMS, generator, longest_pause=1.0)
        code, out, err = finish(process, 200)
    assert (code, err) == (0, ""), out
    assert len(killed) == len(VICTIMS)
    assert killed.count("league-0") == 4
    assert processes_of(folder) == []
    assert_nothing_lost_nor_counted_twice(folder)
    assert_rounds_are_whole(folder, 2, ITERATIONS, UPDATES)
    assert_report_lists(folder, killed)
