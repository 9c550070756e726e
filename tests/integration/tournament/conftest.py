from pathlib import Path

import pytest

from tests.integration.tournament.playing import WORDS, a_run, tournament


@pytest.fixture(scope="package")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run whose tournament was played without a stop."""
    run = a_run(tmp_path_factory.mktemp("small") / "run")
    summary = tournament(run, *WORDS, "--actors", "2")
    assert summary["bouts"] == summary["bouts_planned"] == 3 * 3 * 12
    return run
