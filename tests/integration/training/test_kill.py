"""The short version of tests/chaos, for every run of the suite."""

from pathlib import Path

import numpy as np
import pytest

from tests.integration.small import SMALL
from tests.integration.training.killing import (
    IN_TURN,
    assert_nothing_lost_nor_counted_twice,
    assert_report_lists,
    kill_in_turn,
)
from tests.integration.training.training import finish, processes_of, training

pytestmark = [pytest.mark.zenoh, pytest.mark.timeout(400)]

ENDURING = (
    *SMALL,
    "league.antagonist_updates=50",
    "league.protagonist_updates=10",
    "train.record=false",
)


def test_a_run_outlives_the_death_of_every_process_it_needs(tmp_path: Path) -> None:
    folder = tmp_path / "run"
    victims = ["actor-0", IN_TURN, "league-0", "router-0"]
    with training(folder, overrides=ENDURING) as process:
        killed = kill_in_turn(folder, process, victims, np.random.default_rng(), longest_pause=0.3)
        code, out, err = finish(process, 240)
    assert (code, err) == (0, ""), out
    assert killed == ["actor-0", "learner-antagonist", "league-0", "router-0"]
    assert processes_of(folder) == []
    assert_nothing_lost_nor_counted_twice(folder)
    assert_report_lists(folder, killed)
