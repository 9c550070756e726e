"""`riposte tournament` with real processes, a real bus and real physics."""

import shutil
from pathlib import Path

import numpy as np
import pytest

from services.jobs.runs import state_of
from services.jobs.tournament.ratings import bouts_of
from services.jobs.tournament.results import standings_of
from shared.styles.bouts import load
from tests.integration.tournament.playing import assert_one_opponent_a_bout, riposte, tournament
from tests.integration.training.training import one_line, processes_of

pytestmark = pytest.mark.zenoh


def test_everybody_meets_everybody_of_the_other_side(finished: Path):
    found = state_of(finished / "tournament")
    assert found.finished
    assert found.is_tournament
    assert len(found.evaluations) == 9
    assert {record.done for record in found.evaluations.values()} == {12}
    assert_one_opponent_a_bout(found)
    # A busy machine may start the second one after the first has played everything.
    assert {lease.grant.actor for lease in found.leases.values()} <= {"actor-0", "actor-1"}
    table = load(finished / "tournament" / "bouts.parquet")
    assert [table.label(ref) for ref in table.antagonists] == [
        "antagonist 1", "antagonist 2", "stab",
    ]  # fmt: skip
    assert table.label(table.protagonists[-1]) == "static"
    assert len(np.unique(table.features[:, 0, 3])) > 50  # nobody's bouts are all the same
    assert processes_of(finished / "tournament") == []


def test_replay_of_the_ledger_rebuilds_table_payoff_and_ratings_exactly(finished: Path):
    saved = load(finished / "tournament" / "bouts.parquet")
    rebuilt = bouts_of(finished)
    for name in ("score", "features", "bout", "seed", "antagonist", "protagonist"):
        assert getattr(rebuilt, name).tobytes() == getattr(saved, name).tobytes(), name
    assert rebuilt.provenance == saved.provenance
    one, two = standings_of(rebuilt), standings_of(saved)
    assert one.payoff.low.tobytes() == two.payoff.low.tobytes()
    assert one.ratings == two.ratings
    assert one.nash == two.nash


def test_ratings_prints_the_same_from_the_ledger_and_from_the_table(finished: Path, tmp_path: Path):
    table = shutil.copy(finished / "tournament" / "bouts.parquet", tmp_path / "bouts.parquet")
    by_ledger, by_table = riposte(["ratings", str(finished)]), riposte(["ratings", str(table)])
    assert by_ledger.returncode == 0, by_ledger.stderr
    assert by_ledger.stdout == by_table.stdout
    assert "antagonist 2" in by_ledger.stdout
    assert "Between the two Nash mixtures" in by_ledger.stdout


def test_the_folder_has_page_numbers_and_recording(finished: Path):
    folder = finished / "tournament"
    page = (folder / "tournament.html").read_text()
    assert page.count("<svg") == 2
    assert "Nash averaging" in page
    assert (folder / "tournament.rrd").read_bytes()[:4] == b"RRF2"


def test_a_finished_tournament_is_not_played_again(finished: Path):
    before = state_of(finished / "tournament").position
    tournament(finished)
    assert state_of(finished / "tournament").position == before
    done = riposte(["tournament", str(finished), "--bouts", "13"])
    assert done.returncode == 2
    assert "begun with --bouts 12, not 13" in one_line(done.stderr)
    done = riposte(["tournament", str(finished), "--against", "scripted"])
    assert done.returncode == 2
    assert "begun without scripted:guard" in one_line(done.stderr)
