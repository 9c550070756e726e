"""The whole pipeline as its quickest budget has it: both phases, tournament, styles, bundle."""

import json
import os
import resource
from pathlib import Path

import msgspec
import pytest

from services.jobs.reproduction.parts import Reproduction
from services.jobs.settings import BUDGETS, Settings
from services.league.history import RunState
from shared.styles.bundle import load_bundle
from tests.integration.training.rounds import assert_rounds_are_whole
from tests.integration.training.training import processes_of, state_of, train

pytestmark = [pytest.mark.zenoh, pytest.mark.slow]

MINUTES = 10
CORES = 2
ROUNDS = 6
QUIET = 0.5
"""Load of the machine below which its clock says something."""


@pytest.mark.timeout(3600)
def test_the_quick_budget_goes_from_nothing_to_a_bundle_in_ten_minutes(tmp_path: Path) -> None:
    folder = tmp_path / "run"
    is_quiet = os.getloadavg()[0] < QUIET
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    words = ("--phase", "all", "--budget", "quick")
    code, out, err = train(folder, *words, overrides=(), seconds=3500)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    assert (code, err) == (0, ""), out
    assert processes_of(folder) == []

    counts = Settings.load(None, BUDGETS["quick"])
    league, bouts = counts.league, counts.train.tournament_bouts
    assert_rounds_are_whole(
        folder, ROUNDS, league.round_iterations, league.round_antagonist_updates
    )
    tournament: RunState = state_of(folder / "tournament")
    players = 1 + ROUNDS
    assert tournament.finished
    assert tournament.evaluation_done == players * players * bouts

    summary = json.loads((folder / "summary.json").read_bytes())
    assert summary["finished"]
    assert summary["origin"]["command"].startswith("riposte train --out ")
    assert len(summary["rounds"]) == ROUNDS
    found = msgspec.json.decode((folder / "reproduction.json").read_bytes(), type=Reproduction)
    assert [lacking.part for lacking in found.missing] == ["exploitability"]
    names = [stage.name for stage in found.stages]
    assert names[:2] == ["start of the processes", "phase one, iteration 1"]
    assert names[-3:] == ["report", "tournament", "styles"]
    assert [name for name in names if name.startswith("round")] == [
        f"round {number}" for number in range(1, ROUNDS + 1)
    ]
    assert all(stage.seconds > 0.0 for stage in found.stages)
    page = (folder / "reproduction.html").read_text()
    assert all(name in page for name in names)
    bundle = load_bundle(folder / "bundle").bundle
    assert [player.name for player in bundle.players] == [
        "warm-start", "style-1", "style-2", "style-3",
    ]  # fmt: skip
    assert bundle.trained_by == summary["origin"]["command"].replace(str(folder), folder.name)

    cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    (tmp_path / "measured.json").write_text(
        json.dumps({"cpu_s": cpu, "stages": {s.name: s.seconds for s in found.stages}})
    )
    assert cpu < MINUTES * 60 * CORES, f"{cpu:.0f} CPU seconds"
    if is_quiet:
        assert found.seconds < MINUTES * 60, f"{found.seconds:.0f} s"
