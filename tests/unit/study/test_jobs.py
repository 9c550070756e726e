"""The subcommands of `riposte study` that make, check, export and delete."""

import csv
import importlib.util
import io
import shutil
from pathlib import Path

import msgspec
import pytest

from services.cli import main
from services.jobs.study.command import SUBCOMMANDS
from shared.study.events import Event, Noted
from shared.study.folder import open_study
from shared.study.protocol_file import shipped_protocol
from tests.unit.study.made import play, study_in


@pytest.fixture(scope="module")
def played(tmp_path_factory):
    study = study_in(tmp_path_factory.mktemp("played") / "s")
    play(study, "sub-01", is_repeated="s1-g02")
    return study


def run(capsys, *words, code=0):
    assert main(["study", *map(str, words)]) == code
    said = capsys.readouterr()
    return said.out + said.err


def table(path):
    return list(csv.DictReader(io.StringIO(path.read_text(encoding="utf-8"))))


@pytest.mark.parametrize("name", [each.name for each in SUBCOMMANDS])
def test_every_subcommand_is_there(name):
    found = importlib.util.find_spec(f"services.jobs.study.{name}")  # some take long to import
    assert found is not None
    assert found.origin is not None
    assert "\ndef main(argv: Sequence[str]) -> int:" in Path(found.origin).read_text("utf-8")


def test_a_study_is_made_checked_and_given_its_orders(tmp_path, capsys):
    folder = tmp_path / "s"
    assert str(folder) in run(capsys, "new", "study-two", folder)
    assert "16 orders (random)" in run(
        capsys, "allocate", folder, "--people", "16", "--seed", "3"
    )  # fmt: skip
    said = run(capsys, "check", folder)
    assert "study-two: 2 sections, 20 games" in said
    assert "note  consent.text is a placeholder" in said
    assert "player scripted:heuristic: scripted:heuristic" in said
    assert "0 sessions of 16 participants" in said
    assert len(open_study(folder).assignments) == 16


def test_a_policy_that_is_missing_is_named_with_who_needs_it(tmp_path, capsys):
    text = shipped_protocol("study-one").read_text(encoding="utf-8")
    path = tmp_path / "mine.toml"
    path.write_text(text.replace('player = "style-2"', 'player = "style-9"'), encoding="utf-8")
    said = run(capsys, "check", path, code=2)
    assert "condition 'policy-2': player 'style-9'" in said
    path.write_text(text.replace('player = "style-2"', f'player = "sha256:{"0" * 64}"'))
    assert "holds snapshot 000000000000" in run(capsys, "check", path, code=2)


def test_an_incomplete_williams_design_is_pointed_out(tmp_path, capsys):
    run(capsys, "new", "template", tmp_path / "s")
    said = run(capsys, "allocate", tmp_path / "s", "--people", "7", "--seed", "3")
    assert "multiple of 6 people" in said


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["chekc", "x"], "did you mean 'check'"),
        (["new", "study-three", "x"], "'study-three' is no protocol"),
        (["check", "nowhere.toml"], "cannot read protocol nowhere.toml"),
        (["allocate", "nowhere", "--people", "0", "--seed", "1"], "--people is 0"),
        (["allocate", "nowhere", "--people", "3", "--seed", "-1"], "--seed is -1"),
        (["allocate", "nowhere", "--people", "3", "--seed", "1"], "nowhere is no study"),
        (["withdraw", "nowhere", "--participant", "sub-01"], "nothing of sub-01"),
    ],
)
def test_what_cannot_be_done_is_said_in_one_line(tmp_path, monkeypatch, capsys, words, said):
    monkeypatch.chdir(tmp_path)
    told = run(capsys, *words, code=2)
    assert said in told
    assert told.count("\n") == 1


def test_an_export_is_blinded_unless_asked_otherwise(played, tmp_path, capsys):
    run(capsys, "export", played.folder, "--out", tmp_path / "blind")
    blind = {path.name: table(path) for path in (tmp_path / "blind").iterdir()}
    assert {row["condition"] for row in blind["games.csv"]} <= {"", "A", "B", "C"}
    whole = "".join(path.read_text() for path in (tmp_path / "blind").iterdir())
    for name, entry in played.key.label.items():
        assert entry.condition not in whole, name
    assert "sha256:" not in whole
    assert len(blind["games.csv"]) == 11
    assert [row["outcome"] for row in blind["games.csv"]].count("repeat") == 1
    run(capsys, "export", played.folder, "--out", tmp_path / "open", "--unblind")
    games = table(tmp_path / "open" / "games.csv")
    assert tuple(row["condition"] for row in games[2:11:3]) == played.order_of("sub-01")
    assert games[1]["policy"].startswith("sha256:")
    words = {row["text"] for row in table(tmp_path / "open" / "questionnaire.csv")}
    assert {"my\town\nwords", 'said "n/a"; then\t\\n'} <= words


def test_a_note_is_exported_with_its_place_in_the_session(played, tmp_path, capsys):
    folder = tmp_path / "noted"
    shutil.copytree(played.folder, folder)
    journal = folder / "sub-01" / "ses-01" / "journal.jsonl"
    lines = journal.read_bytes().splitlines()
    last = msgspec.json.decode(lines[-1], type=Event)
    note = msgspec.structs.replace(
        last, number=last.number + 1, step="s2-g03", what=Noted(text="the, phone")
    )
    journal.write_bytes(b"\n".join([*lines, msgspec.json.encode(note), b""]))
    run(capsys, "export", folder, "--out", tmp_path / "out")
    (row,) = table(tmp_path / "out" / "notes.csv")
    assert (row["section"], row["game"], row["text"]) == ("2", "3", "the, phone")
    assert row["condition"] == played.labels_of("sub-01")[1]
    assert (row["config"], row["commit"], row["policy"]) == ("c" * 64, "abc", "")
    run(capsys, "export", folder, "--out", tmp_path / "open", "--unblind")
    (row,) = table(tmp_path / "open" / "notes.csv")
    assert row["condition"] == played.order_of("sub-01")[1]
    assert row["policy"].startswith("sha256:")


@pytest.fixture
def keyless(played, tmp_path):
    """A copy of the study from which the key was taken away, whose tables lag behind."""
    folder = tmp_path / "keyless"
    shutil.copytree(played.folder, folder, ignore=shutil.ignore_patterns("key.toml"))
    for path in folder.glob("sub-*/ses-*/*.tsv"):
        if path.name != "hr.tsv":
            path.unlink()
    return folder


def test_without_the_key_a_study_is_checked_and_exported_as_with_it(
    played, keyless, tmp_path, capsys
):
    said = run(capsys, "check", keyless)
    assert "key.toml is elsewhere" in said
    assert "error" not in said
    run(capsys, "export", keyless, "--out", tmp_path / "without")
    run(capsys, "export", played.folder, "--out", tmp_path / "with")
    for path in (tmp_path / "with").iterdir():
        assert (tmp_path / "without" / path.name).read_bytes() == path.read_bytes(), path.name
    for path in played.folder.glob("**/*.tsv"):
        assert (keyless / path.relative_to(played.folder)).read_bytes() == path.read_bytes()


@pytest.mark.slow
def test_without_the_key_a_study_is_analysed(keyless, capsys):
    assert "files in" in run(capsys, "analyse", keyless)


def test_what_needs_the_key_says_to_put_it_back(keyless, capsys):
    for words in (
        ["analyse", keyless, "--unblind"],
        ["export", keyless, "--out", keyless.parent / "open", "--unblind"],
        ["allocate", keyless, "--people", "8", "--seed", "7"],
        ["run", keyless, "--participant", "sub-02"],
    ):
        assert "put the key back" in run(capsys, *words, code=2)


def test_an_export_into_a_folder_that_holds_something_is_refused(played, tmp_path, capsys):
    (tmp_path / "thesis.tex").write_text("precious")
    assert "not empty" in run(capsys, "export", played.folder, "--out", tmp_path, code=2)


def test_tables_that_lag_behind_the_journal_are_noticed_and_written_anew(tmp_path, capsys):
    study = study_in(tmp_path / "s")
    play(study, "sub-01")
    games = study.session_folder("sub-01") / "games.tsv"
    whole = games.read_bytes()
    games.write_bytes(b"".join(whole.splitlines(keepends=True)[:3]))
    said = run(capsys, "check", study.folder)
    assert "sub-01, session 1: games.tsv differ from the journal" in said
    assert "no archive of s1-g01-1, s1-g02-1, s1-g03-1 and 6 more games" in said
    run(capsys, "export", study.folder, "--out", tmp_path / "out")
    assert games.read_bytes() == whole


def test_a_damaged_journal_is_an_error_of_the_check(tmp_path, capsys):
    study = study_in(tmp_path / "s")
    session = study.session_folder("sub-03")
    session.mkdir(parents=True)
    (session / "journal.jsonl").write_text("{}\n")
    said = run(capsys, "check", study.folder, code=1)
    assert "journal.jsonl:1: damaged" in said


def test_withdraw_without_a_terminal_asks_nobody(tmp_path, capsys):
    study = study_in(tmp_path / "s")
    assert "says that somebody withdrew" in run(
        capsys, "withdraw", study.folder, "--participant", "sub-02"
    )  # fmt: skip
    assert len(open_study(study.folder).assignments) == 3
