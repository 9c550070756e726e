"""How people moved, from archived games: features of the human's bat, and who varies more."""

import shutil

import msgspec
import numpy as np
import pytest

from shared.errors import RiposteError
from shared.study.analysis.chapters.strategy import strategy_chapter
from shared.study.analysis.games import games_of
from shared.study.analysis.moves import bout_features, moves_of
from shared.study.tables import load_study
from shared.styles.features import FEATURES
from shared.telemetry.archive import BoutInfo, load_bout, parquet_of
from shared.telemetry.streams import BATS, DTYPES, REFEREE, Rows
from tests.unit.study_analysis.made import Person, write_study

STEPS = 40
NAMES = [feature.name for feature in FEATURES]


def archive(folder, width):
    """Write a game of 0.4 s in which the bat goes ``width`` metres along y at an even speed."""
    folder.mkdir(parents=True)
    info = BoutInfo(
        bout=folder.name, antagonist="person", protagonist="scripted:heuristic",
        outcome="finished", started_at_ns=1, robot_io_boot="boot",
    )  # fmt: skip
    extra = STEPS + 10  # rows before the first step that is judged
    for stream in (BATS, REFEREE):
        columns = {}
        for column in stream.columns:
            shape = (extra, column.width) if column.width else (extra,)
            columns[column.name] = np.zeros(shape, DTYPES[column.kind])
            if column.kind == "text":
                columns[column.name][:] = "boot" if column.name == "boot" else folder.name
        columns["tick"] = np.arange(extra)
        rows = Rows(columns)
        if stream is BATS:
            along = np.clip(np.arange(extra) - 10, 0, None) / (STEPS - 1.0)
            columns["antagonist_position"][:, 1] = width * along
            columns["antagonist_velocity"][:, 1] = width / (STEPS - 1) / 0.01
            columns["antagonist_position"][:10, 0] = 5.0  # not judged: it must not count
        else:
            columns["step"] = np.arange(extra) - 9  # steps judged, with this one
            rows = rows.pick(np.arange(10, extra))
        (folder / f"{stream.name}.parquet").write_bytes(parquet_of(stream, rows, info))
    (folder / "bout.json").write_bytes(msgspec.json.encode(info))


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    """A study of eight of whom the second half scores more and moves more variedly."""
    folder = tmp_path_factory.mktemp("moves") / "s"
    generator = np.random.default_rng(2)

    def make(k, order):
        return Person({name: generator.normal(100.0 * k, 20.0, 10) for name in order})

    made = write_study(folder, "study-two", 8, make)
    for k in range(8):
        session = made.session_folder(f"sub-{k + 1:02d}")
        for game in range(1, 5):
            width = 1.0 + (0.4 if k >= 4 else 0.05) * generator.standard_normal()
            archive(session / "bouts" / f"s1-g{game:02d}", abs(width))
    return folder


def test_only_steps_that_were_judged_count(tmp_path):
    archive(tmp_path / "one", 1.5)
    found = dict(zip(NAMES, bout_features(load_bout(tmp_path / "one")), strict=True))
    assert found["displacement_x"] == pytest.approx(0.0)
    assert found["displacement_y"] == pytest.approx(1.5)
    assert found["mean_velocity"] == pytest.approx(1.5 / 0.39)


def test_an_archive_without_bat_states_is_said_to_have_none(tmp_path):
    archive(tmp_path / "one", 1.5)
    (tmp_path / "one" / "bats.parquet").unlink()
    with pytest.raises(RiposteError, match="no bat states"):
        bout_features(load_bout(tmp_path / "one"))


def test_the_best_people_move_more_variedly(study):
    games = games_of(load_study(study))
    moves = moves_of(study, games)
    assert moves.note == "128 games have no archive."
    chapter = strategy_chapter(games, moves, np.random.default_rng(0))
    found = next(f for f in chapter.findings if "variance of displacement y" in f.question)
    assert found.question.endswith("4 best over 4 worst people")
    assert found.estimate.low > 1.0
    assert found.p < 0.05
    table = next(table for table in chapter.tables if table.name == "style_variance")
    row = next(row for row in table.rows if row[0] == "displacement y")
    widths = moves.features[:, :, :, NAMES.index("displacement_y")].reshape(8, -1)
    variances = np.nanvar(widths, axis=1, ddof=1)
    means = variances[4:].mean(), variances[:4].mean()
    assert row[1:4] == ("yes", pytest.approx(means[0], rel=1e-3), pytest.approx(means[1], rel=1e-3))
    assert row[4] == f"{100 * (means[0] / means[1] - 1):+.0f} %"


def test_a_damaged_archive_is_left_out_and_named(study, tmp_path):
    shutil.copytree(study, tmp_path / "s")
    path = tmp_path / "s" / "sub-01" / "ses-01" / "bouts" / "s1-g01" / "bats.parquet"
    path.write_bytes(b"PAR1 but not really")
    moves = moves_of(tmp_path / "s", games_of(load_study(tmp_path / "s")))
    assert "1 archives cannot be used" in moves.note
    assert np.isnan(moves.features[0, 0, 0]).all()


def test_without_archives_the_reason_is_given(tmp_path):
    def make(k, order):
        return Person({name: [float(k)] * 10 for name in order})

    write_study(tmp_path / "s", "study-two", 4, make)
    games = games_of(load_study(tmp_path / "s"))
    chapter = strategy_chapter(games, moves_of(tmp_path / "s", games), np.random.default_rng(0))
    assert "no archived game in the study folder" in " ".join(chapter.says)
