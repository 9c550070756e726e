"""Both phases by real processes: from the pair of a run to its library."""

import json
from pathlib import Path

import pytest

from tests.integration.training.killing import assert_nothing_lost_nor_counted_twice
from tests.integration.training.rounds import assert_rounds_are_whole
from tests.integration.training.training import SMALL, processes_of, state_of, train

pytestmark = [pytest.mark.zenoh, pytest.mark.slow, pytest.mark.timeout(600)]

ROUNDS = (
    *SMALL,
    "train.record=false",
    "league.round_iterations=3",
    "league.round_antagonist_updates=2",
    "league.round_protagonist_updates=2",
)


def test_phase_two_goes_on_from_the_pair_of_a_run_that_was_moved_to_a_library(
    tmp_path: Path,
) -> None:
    folder = tmp_path / "run"
    code, _, err = train(folder, "--phase", "one", overrides=ROUNDS, seconds=240)
    assert (code, err) == (0, "")
    before = state_of(folder)
    assert before.library() == []
    folder = folder.rename(tmp_path / "moved")

    code, out, err = train(folder, "--phase", "two", "--rounds", "2", overrides=(), seconds=240)
    assert (code, err) == (0, ""), out
    after = state_of(folder)
    assert after.ends == 2
    assert after.warm_start() == before.warm_start()
    assert_rounds_are_whole(folder, 2, 3, 2)
    assert_nothing_lost_nor_counted_twice(folder)
    assert processes_of(folder) == []
    assert (folder / "reproduction.html").is_file()
    assert after.run == "run"
    first, second = json.loads((folder / "summary.json").read_bytes())["origin"]["command"].split(
        " && "
    )
    assert first.startswith(f"riposte train --out {tmp_path / 'run'} --phase one --set")
    assert second == f"riposte train --out {folder} --phase two --rounds 2"
