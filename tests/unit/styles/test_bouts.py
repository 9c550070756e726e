import dataclasses
import subprocess
import sys
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from shared.errors import RiposteError
from shared.styles.bouts import FEATURE_COLUMNS, METADATA_KEY, BoutTable, load, save
from shared.styles.features import FEATURES
from tests.unit.styles.making import table


def same(one: BoutTable, other: BoutTable) -> bool:
    for field in dataclasses.fields(BoutTable):
        mine, its = getattr(one, field.name), getattr(other, field.name)
        if isinstance(mine, np.ndarray):
            mine = (mine.dtype, mine.shape, mine.tobytes())
            its = (its.dtype, its.shape, its.tobytes())
        if mine != its:
            return False
    return True


def test_a_saved_table_is_loaded_bit_for_bit_and_always_makes_the_same_file(tmp_path: Path):
    made = table()
    save(made, tmp_path / "one.parquet")
    save(made, tmp_path / "two.parquet")
    assert same(load(tmp_path / "one.parquet"), made)
    assert (tmp_path / "one.parquet").read_bytes() == (tmp_path / "two.parquet").read_bytes()


def test_the_file_has_a_column_for_each_feature_and_side_and_says_where_it_comes_from(
    tmp_path: Path,
):
    save(table(), tmp_path / "bouts.parquet")
    found = pq.read_table(tmp_path / "bouts.parquet")
    assert set(FEATURE_COLUMNS) <= set(found.column_names)
    assert len(FEATURE_COLUMNS) == 2 * len(FEATURES)
    assert b'"run":"made-up"' in found.schema.metadata[METADATA_KEY]
    names = found.column("antagonist").to_pylist()
    assert names == [ref for ref in table().antagonists for _ in range(12)]


def test_players_who_have_not_met_anybody_yet_keep_their_place(tmp_path: Path):
    made = table()
    late = made.antagonist == 1
    some = dataclasses.replace(
        made,
        **{
            field.name: getattr(made, field.name)[late]
            for field in dataclasses.fields(BoutTable)
            if isinstance(getattr(made, field.name), np.ndarray)
        },
    )
    save(some, tmp_path / "bouts.parquet")
    assert same(load(tmp_path / "bouts.parquet"), some)


@pytest.mark.slow
def test_a_program_that_has_read_a_table_ends_well(tmp_path: Path):
    """With pyarrow's own threads about one in five aborted at the end of the interpreter."""
    save(table(), tmp_path / "bouts.parquet")
    code = (
        "import sys; from pathlib import Path; from shared.styles.bouts import load; "
        "load(Path(sys.argv[1]))"
    )
    command = [sys.executable, "-P", "-c", code, str(tmp_path / "bouts.parquet")]
    for _ in range(20):
        done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
        assert (done.returncode, done.stderr) == (0, "")


def test_labels_fall_back_to_the_first_digits_of_the_hash():
    made = table()
    assert made.label(made.antagonists[0]) == "antagonist 1"
    assert made.label(made.antagonists[1]) == "a1000000"
    assert made.label("scripted:static") == "static"


def test_a_missing_file_says_how_to_make_one(tmp_path: Path):
    with pytest.raises(RiposteError, match="play the bouts with: riposte tournament RUN"):
        load(tmp_path / "bouts.parquet")


def damaged(path: Path) -> str:
    with pytest.raises(RiposteError) as error:
        load(path)
    text = str(error.value)
    assert "\n" not in text
    assert str(path) in text
    assert "riposte tournament RUN" in text
    return text


@pytest.mark.parametrize("end", [0, 100, -1])
def test_a_file_cut_short_is_refused_in_one_line(tmp_path: Path, end: int):
    path = tmp_path / "bouts.parquet"
    save(table(), path)
    path.write_bytes(path.read_bytes()[:end])
    assert "damaged" in damaged(path)


def test_a_flipped_byte_never_passes_as_other_bouts(tmp_path: Path):
    path = tmp_path / "bouts.parquet"
    made = table()
    save(made, path)
    whole = path.read_bytes()
    refusals: list[str] = []
    for at in range(4, len(whole) - 8, 97):
        path.write_bytes(whole[:at] + bytes([whole[at] ^ 0x40]) + whole[at + 1 :])
        try:
            again = load(path)
        except RiposteError as error:
            refusals.append(str(error))
        else:  # where no reader looks: a statistic, or the name of the writer
            assert again.features.tobytes() == made.features.tobytes()
            assert again.score.tobytes() == made.score.tobytes()
    assert refusals
    assert not any("\n" in refusal for refusal in refusals)


@pytest.mark.parametrize("column", ["score", "bout", "protagonist", "antagonist_mean_jerk"])
def test_a_missing_column_is_named(tmp_path: Path, column: str):
    path = tmp_path / "bouts.parquet"
    save(table(), path)
    pq.write_table(pq.read_table(path).drop_columns([column]), path)
    assert f"no column '{column}'" in damaged(path)


def test_another_programs_table_is_refused(tmp_path: Path):
    path = tmp_path / "bouts.parquet"
    pq.write_table(pa.table({"x": [1.0]}), path)
    assert "its metadata says nothing of a tournament" in damaged(path)


def test_a_score_that_is_no_number_is_refused(tmp_path: Path):
    path = tmp_path / "bouts.parquet"
    made = table()
    made.score[3] = np.nan
    save(made, path)
    assert "not finite" in damaged(path)
