"""What the command line of `riposte train` asks for, and what it refuses."""

from collections.abc import Sequence
from pathlib import Path

import pytest

from services.jobs.settings import Settings
from services.jobs.train.arguments import check_folder, folder_of, is_over, parse, settings_of
from shared.errors import ConfigError
from tests.unit.jobs.ledgers import stopped_run
from tests.unit.jobs.two_phases import played_run


def asked(*words: str | Path) -> Settings:
    """Return the settings of a command line."""
    found = parse([str(word) for word in words])
    return settings_of(found, folder_of(found)[0])


def refused(*words: str | Path) -> str:
    """Return the one line with which a command line is refused."""

    def begin() -> None:
        found = parse([str(word) for word in words])
        folder, _ = folder_of(found)
        check_folder(found, folder, settings_of(found, folder))

    with pytest.raises(ConfigError) as caught:
        begin()
    text = str(caught.value)
    assert "\n" not in text
    return text


@pytest.mark.parametrize(
    ("words", "rounds"),
    [
        ((), 0),
        (("--phase", "one"), 0),
        (("--phase", "all"), 6),
        (("--phase", "all", "--rounds", "2"), 2),
        (("--phase", "all", "--budget", "quick"), 6),
        (("--phase", "all", "--set", "league.rounds=3"), 3),
        (("--phase", "one", "--set", "league.rounds=3"), 3),
    ],
)
def test_rounds_follow_from_the_phase(tmp_path: Path, words: Sequence[str], rounds: int) -> None:
    assert asked("--out", tmp_path / "run", *words).league.rounds == rounds


def test_the_paper_counts_are_the_budget_of_that_name(tmp_path: Path) -> None:
    league = asked("--out", tmp_path / "run", "--phase", "all", "--budget", "paper").league
    assert (league.iterations, league.rounds, league.round_iterations) == (2, 6, 35)
    assert league.sampler == "uniform"
    assert asked("--out", tmp_path / "run", "--sampler", "pfsp").league.sampler == "pfsp"


def test_rounds_need_phase_two(tmp_path: Path) -> None:
    out = ("--out", tmp_path / "run")
    assert "--rounds 3 needs --phase two or --phase all" in refused(*out, "--rounds", "3")
    text = refused(*out, "--phase", "one", "--rounds", "3")
    assert "needs --phase two or --phase all" in text
    assert "at least 1" in refused(*out, "--phase", "all", "--rounds", "0")


def test_phase_two_needs_a_run_with_a_pair(tmp_path: Path) -> None:
    folder = tmp_path / "run"
    text = refused("--out", folder, "--phase", "two")
    assert f"train one first with: riposte train --out {folder}" in text
    assert not folder.exists()
    stopped_run(folder)
    text = refused("--out", folder, "--phase", "two")
    assert "phase one" in text
    assert "is not finished (2 of 4 stages begun)" in text
    assert f"riposte train --resume --out {folder}" in text


def test_phase_all_does_not_begin_over_a_run(tmp_path: Path) -> None:
    played_run(tmp_path / "run")
    text = refused("--out", tmp_path / "run", "--phase", "all")
    assert "holds a run already; continue it with --resume" in text


def test_a_run_of_both_phases_is_over_until_more_rounds_are_asked_for(tmp_path: Path) -> None:
    folder = tmp_path / "run"
    state = played_run(folder)
    assert state.config is not None
    same = ("--set", f"league.rounds={state.config.rounds}", "--set", "league.round_iterations=8")
    assert is_over(folder, asked("--out", folder, *same))
    more = ("--phase", "two", "--rounds", "4", "--set", "league.round_iterations=8")
    settings = asked("--out", folder, *more)
    assert settings.league.rounds == 4
    assert not is_over(folder, settings)
    assert not is_over(tmp_path / "nowhere", settings)


@pytest.mark.parametrize(
    "words", [("--phase", "three"), ("--sampler", "best"), ("--budget", "endless")]
)
def test_words_that_mean_nothing_are_refused(
    words: Sequence[str], capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as caught:
        parse(words)
    assert caught.value.code == 2
    assert "choose from" in capsys.readouterr().err
