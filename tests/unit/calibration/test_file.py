import datetime
from pathlib import Path

import pytest

from services.robot_io.vive.calibration import load_calibration
from shared.errors import ConfigError
from tests.unit.calibration.making import calibration, write

NOW = datetime.datetime(2026, 11, 21, 12, 0, tzinfo=datetime.UTC)
NOW_NS = round(NOW.timestamp() * 1e9)


@pytest.mark.parametrize("dock", [None, (1.0, 2.0, 3.0)])
def test_what_is_written_is_read_back(tmp_path: Path, dock: tuple[float, float, float] | None):
    made = calibration(made_at=NOW, dock=dock)
    path = write(tmp_path / "vive.toml", made)
    assert load_calibration(path) == made
    text = path.read_text()
    assert "made_at = 2026-11-21" in text
    assert "held_out_mm = 4.0" in text
    assert [child.name for child in tmp_path.iterdir()] == ["vive.toml"]


def test_an_old_calibration_is_refused_in_one_line():
    old = calibration(made_at=NOW - datetime.timedelta(days=31, hours=12))
    old.check_age(NOW_NS, 32.0)
    with pytest.raises(ConfigError) as caught:
        old.check_age(NOW_NS, 30.0)
    assert str(caught.value) == (
        "calibration too old: 31.5 days, limit 30: run riposte robot calibrate"
    )


def test_one_from_the_future_is_refused():
    with pytest.raises(ConfigError, match="5 days ahead"):
        calibration(made_at=NOW + datetime.timedelta(days=5)).check_age(NOW_NS, 30.0)


def test_it_says_how_good_it_is():
    made = calibration(made_at=NOW - datetime.timedelta(days=2))
    assert made.describe(NOW_NS) == (
        "calibrated 2.0 days ago on 30 poses, 4.0 mm on poses held out"
    )


@pytest.mark.parametrize(
    ("change", "text"),
    [
        (("schema = 1", "schema = 2"), "schema 2, expected 1"),
        (("poses = 30", "poses = 'many'"), "is damaged"),
        (("poses = 30", "poses = 30\nextra = 1"), "is damaged"),
        (("1.0,\n", "nan,\n"), "torso_from_base of .* is not a pose"),
        (("serial = ", "serial"), "is damaged"),
        (("+00:00", ""), "no time zone"),
    ],
)
def test_a_damaged_file_is_one_line(tmp_path: Path, change: tuple[str, str], text: str):
    path = write(tmp_path / "vive.toml", calibration())
    before = path.read_text()
    after = before.replace(*change, 1)
    assert after != before
    path.write_text(after)
    with pytest.raises(ConfigError, match=text) as caught:
        load_calibration(path)
    assert "\n" not in str(caught.value)


def test_no_file_is_one_line(tmp_path: Path):
    with pytest.raises(ConfigError, match=r"no calibration .*none.toml: run riposte robot calib"):
        load_calibration(tmp_path / "none.toml")
