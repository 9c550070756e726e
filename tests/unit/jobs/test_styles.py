import dataclasses
import json
import re
import tomllib
from pathlib import Path

import msgspec
import numpy as np
import pytest

from services import cli
from services.jobs.styles.command import styles_text, trained_by, write_styles
from services.jobs.styles.summary import StylesSummary
from shared.errors import ConfigError, RiposteError
from shared.styles.bouts import save
from shared.styles.bundle import load_bundle
from shared.styles.features import FEATURES
from tests.unit.jobs.style_runs import STATIC, player, table, write_run
from tests.unit.styles.samples import NOISE, THREE_OF_SIX, TYPICAL

PLANTED = ("round 2", "round 4", "round 6")


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = write_run(tmp_path_factory.mktemp("styles") / "run")
    write_styles(folder)
    return folder


@pytest.fixture(scope="module")
def summary(run: Path) -> StylesSummary:
    return msgspec.json.decode((run / "styles" / "styles.json").read_bytes(), type=StylesSummary)


def test_the_planted_three_are_selected_and_told_apart(summary: StylesSummary):
    assert tuple(policy.label for policy in summary.of_part("selected")) == PLANTED
    assert summary.triples[0].policies == PLANTED
    assert len(summary.triples) == 20
    assert summary.triples[0].smallest > 5.0
    assert summary.selected_apart.policies == PLANTED
    assert summary.selected_apart.random_folds.share > 0.99
    assert summary.library_apart.random_folds.share < 0.9  # the other three are one
    assert summary.information[2] > 0.98
    assert summary.why_not == ""
    assert 3.0 < summary.effective_styles.value < 4.5


def test_a_style_is_the_mean_over_the_bouts_against_phase_twos_antagonists(summary: StylesSummary):
    made = table()
    assert len(summary.opponents) == 6
    for number in (1, 4):
        (policy,) = (policy for policy in summary.policies if policy.round == number)
        assert policy.reference == player("protagonist", number).reference
        assert policy.bouts == 120
        own = made.protagonists.index(policy.reference)
        met = (made.protagonist == own) & (made.antagonist != 0)  # 0 is the warm start's
        rows = made.features[met, 1].astype(np.float64)
        np.testing.assert_allclose(policy.mean, rows.mean(axis=0))
        np.testing.assert_allclose(policy.spread, rows.std(axis=0, ddof=1))
        planted = TYPICAL + NOISE * THREE_OF_SIX[number - 1]
        np.testing.assert_allclose((policy.mean - planted) / NOISE, 0.0, atol=0.4)
        assert policy.score == pytest.approx(made.score[met].mean())


def test_warm_start_and_scripted_players_are_measured_but_not_selected(summary: StylesSummary):
    (warm,) = summary.of_part("warm_start")
    assert warm.reference == player("protagonist", 0).reference
    np.testing.assert_allclose((warm.mean - TYPICAL) / NOISE, -1.0, atol=0.4)
    (still,) = summary.of_part("other")
    assert (still.label, still.reference) == ("static", STATIC)
    assert "static" not in summary.library
    assert len(summary.library) == 6


def test_the_bundle_holds_the_selected_three_and_the_warm_start(run: Path, summary: StylesSummary):
    found = load_bundle(run / "bundle")
    assert list(found.snapshots) == ["warm-start", "style-1", "style-2", "style-3"]
    assert [p.round for p in found.bundle.players] == [0, 2, 4, 6]
    for made in found.bundle.players:
        stored = run / "snapshots" / f"{made.sha256}.safetensors"
        copied = run / "bundle" / f"{made.sha256}.safetensors"
        assert copied.read_bytes() == stored.read_bytes()
        assert made.sha256 == player("protagonist", made.round).digest
    assert found.bundle.criterion_value == summary.triples[0].smallest
    assert found.bundle.run == "made-up"
    assert found.bundle.bouts == 120
    style = found.bundle.player("style-1").style
    assert list(style) == [feature.name for feature in FEATURES]
    assert style["displacement_x"] == pytest.approx(TYPICAL[0] + 8 * NOISE[0], abs=NOISE[0] / 2)


def test_no_path_of_this_machine_is_in_what_is_handed_on(run: Path):
    for file in (run / "bundle" / "bundle.toml", run / "styles" / "styles.json"):
        assert str(run.parent) not in file.read_text()
    bundle = tomllib.loads((run / "bundle" / "bundle.toml").read_text())
    assert bundle["selected_by"] == "riposte styles run"
    assert bundle["trained_by"] == "riposte train run/config.toml --phase all --out AGAIN"


def test_the_command_that_made_the_run_is_kept(tmp_path: Path):
    made = {"origin": {"command": "riposte train --phase all --rounds 6"}}
    (tmp_path / "summary.json").write_text(json.dumps(made))
    assert trained_by(tmp_path) == "riposte train --phase all --rounds 6"
    made["origin"]["command"] = f"riposte train {tmp_path}/a.toml --phase all --out={tmp_path} && x"
    (tmp_path / "summary.json").write_text(json.dumps(made))
    assert trained_by(tmp_path) == f"riposte train a.toml --phase all --out={tmp_path.name} && x"
    (tmp_path / "summary.json").write_text("{}")
    again = f"riposte train {tmp_path.name}/config.toml --phase all --out AGAIN"
    assert trained_by(tmp_path) == again


def test_the_page_loads_nothing_and_names_everybody(run: Path, summary: StylesSummary):
    page = (run / "styles" / "styles.html").read_text()
    links = re.findall(r"(?:src|href|url)\s*[=(]\s*[\"']?([^\"')\s>]+)", page)
    assert all(link.startswith(("#", "data:")) for link in links)
    assert "<script" not in page
    assert page.count("<svg") == 2
    for policy in summary.policies:
        assert policy.label in page
    for player_ in load_bundle(run / "bundle").bundle.players:
        assert player_.sha256[:16] in page
    assert f"{summary.information[2]:.2%}" in page
    assert "goal of 90% for three policies is met" in page


def test_the_command_prints_json_and_the_same_table_gives_the_same_bytes(
    run: Path, capsys: pytest.CaptureFixture[str]
):
    files = ("styles/styles.json", "styles/styles.html", "bundle/bundle.toml")
    before = [(run / name).read_bytes() for name in files]
    assert cli.main(["styles", str(run), "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == json.loads(before[0])
    assert [(run / name).read_bytes() for name in files] == before


def test_the_screen_names_the_selected_and_where_the_rest_is(run: Path, summary: StylesSummary):
    said = styles_text(summary, run)
    assert "round 2*" in said
    assert "round 1*" not in said
    assert "selected  round 2, round 4, round 6" in said
    assert "told apart of three: 100.0%" in said
    assert f"{summary.effective_styles.value:.2f} [" in said
    assert str(run / "bundle") in said


def test_columns_stay_apart_whoever_is_measured(summary: StylesSummary, tmp_path: Path):
    longer = [
        msgspec.structs.replace(policy, label=f"{policy.label} heuristic-retreating")
        for policy in summary.policies
    ]
    wide = msgspec.structs.replace(summary, policies=tuple(longer))
    lines = styles_text(wide, tmp_path).splitlines()
    table = lines[1 : 1 + 1 + len(FEATURES) + 1]
    assert {len(re.split(r"\s{2,}", line.strip())) for line in table[1:]} == {1 + len(longer)}
    assert len({len(line) for line in table}) == 1
    for policy in longer:
        assert policy.label in re.split(r"\s{2,}", table[0].replace("*", ""))


def test_styles_that_differ_in_more_than_three_ways_are_said_to(tmp_path: Path):
    folder = write_run(tmp_path / "run", bouts=10)
    made = table(bouts=10)
    for number in range(1, 7):  # each policy alone in a feature of its own
        own = made.protagonist == number
        made.features[own, 1] = TYPICAL + NOISE * np.random.default_rng(number).normal(
            size=(int(own.sum()), 8)
        )
        made.features[own, 1, number] += 12 * NOISE[number]
    save(made, folder / "tournament" / "bouts.parquet")
    found = write_styles(folder)
    assert found.information[2] < 0.98
    assert "more than three independent ways" in found.why_not
    assert "more than three independent ways" in (folder / "styles" / "styles.html").read_text()


def test_runs_that_cannot_be_judged_are_refused_in_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    short = write_run(tmp_path / "short", rounds=2, bouts=2)
    other = write_run(tmp_path / "other", bouts=2)
    foreign = table(bouts=2)
    strangers = tuple(player("antagonist", 50 + k).reference for k in range(7))
    foreign = dataclasses.replace(foreign, antagonists=strangers)
    save(foreign, other / "tournament" / "bouts.parquet")
    unplayed = write_run(tmp_path / "unplayed", bouts=2)
    (unplayed / "tournament" / "bouts.parquet").unlink()
    for folder, complaint in (
        (tmp_path / "nowhere", "holds no run (no league.sqlite)"),
        (short, "needs at least 3 rounds of phase two, this run has 2"),
        (other, "none against the antagonist of round 1, or is of another run"),
        (unplayed, "play the bouts with: riposte tournament RUN"),
    ):
        assert cli.main(["styles", str(folder)]) == 2
        said = capsys.readouterr().err
        assert complaint in said
        assert said.count("\n") == 1
        assert not (folder / "bundle").exists()


def test_an_interrupted_tournament_is_named_pairing_by_pairing(tmp_path: Path):
    folder = write_run(tmp_path / "run", bouts=4)
    made = table(bouts=4)
    keep = ~((made.protagonist == 3) & (made.antagonist == 5) & (made.bout >= 1))
    columns = {
        field.name: getattr(made, field.name)[keep]
        for field in dataclasses.fields(made)
        if isinstance(getattr(made, field.name), np.ndarray)
    }
    save(dataclasses.replace(made, **columns), folder / "tournament" / "bouts.parquet")
    complaint = "round 3 has played 1 of 4 bouts against the antagonist of round 5; finish with"
    with pytest.raises(RiposteError, match=complaint):
        write_styles(folder)


def test_a_lost_snapshot_leaves_an_older_bundle_whole(tmp_path: Path):
    folder = write_run(tmp_path / "run", bouts=4)
    write_styles(folder)
    before = load_bundle(folder / "bundle").bundle
    chosen = player("protagonist", 4).digest
    (folder / "snapshots" / f"{chosen}.safetensors").unlink()
    with pytest.raises(RiposteError, match="never reported here"):
        write_styles(folder)
    assert load_bundle(folder / "bundle").bundle == before


def test_a_run_without_phase_two_says_what_to_train(tmp_path: Path):
    folder = write_run(tmp_path / "run", rounds=1, bouts=2)
    with pytest.raises(ConfigError, match="riposte train --phase all --rounds 6"):
        write_styles(folder)
