from pathlib import Path

import pytest

from services.jobs.robot.play_programme import chosen
from services.jobs.robot.playable import check_playable
from shared.errors import ConfigError, IdentificationError
from shared.identification.excitation.reading import read_programme
from tests.unit.jobs.programme_stage import home_pose, plan_in, sway, write_folder


def test_a_programme_is_read_back_as_it_was_written(tmp_path: Path):
    plan = plan_in(tmp_path, "one", "two")
    assert [(each.name, each.split) for each in plan.stretches] == [
        ("one", "train"), ("two", "test"),
    ]  # fmt: skip
    assert plan.stretches[0].poses == pytest.approx(sway(home_pose(), 0.03))
    assert plan.reference == f"programme:{plan.digest}"
    check_playable(plan, None)
    assert [each.name for each in chosen(plan, ["two"])] == ["two"]
    with pytest.raises(ConfigError, match="--only tow"):
        chosen(plan, ["tow"])


def test_a_programme_that_was_changed_is_refused(tmp_path: Path):
    plan = plan_in(tmp_path, "one", "two")
    (plan.folder / "one/command.parquet").write_bytes(
        (plan.folder / "two/command.parquet").read_bytes()
    )
    with pytest.raises(IdentificationError, match="changed after the programme was designed"):
        read_programme(plan.folder)


def test_a_programme_of_another_version_is_refused(tmp_path: Path):
    plan = plan_in(tmp_path, "one", "two")
    path = plan.folder / "programme.toml"
    path.write_text(path.read_text().replace("schema = 1", "schema = 2"))
    with pytest.raises(IdentificationError, match="has schema 2, this Riposte plays 1"):
        read_programme(plan.folder)
    with pytest.raises(IdentificationError, match="excite wrote"):
        read_programme(tmp_path / "nothing")


def test_a_programme_that_does_not_fit_the_robot_is_refused(tmp_path: Path):
    home = home_pose()
    site = tmp_path / "site.toml"

    def refusal(text: str, **motions: object) -> str:
        site.write_text(text)
        folder = tmp_path / f"programme-{len(list(tmp_path.iterdir()))}"
        calm = {"one": sway(home, 0.03), "two": sway(home, 0.04)}
        plan = read_programme(write_folder(folder, {**calm, **motions}))  # type: ignore[arg-type]
        with pytest.raises(ConfigError) as error:
            check_playable(plan, site)
        return str(error.value)

    assert "for the right arm" in refusal('[sim]\narms = ["left", "left"]')
    slow = "[safety]\ngame_speed = 0.04\nwarm_up_speed = 0.01"
    assert "one is 1.18 times as fast" in refusal(slow)
    y = float(home[1])
    assert "mm outside" in refusal(f"[safety]\nbox_high = [0.95, {y + 0.03:.4f}, 0.55]")
    assert "ahead of the tool" in refusal("[safety]\nlead = 0.02")
    assert "return_home" in refusal("[robot_io]\nreturn_home = false")
    elsewhere = sway(home, 0.03)
    elsewhere[:, 2] += 0.03
    assert "one begins 3.0 cm" in refusal("", one=elsewhere)
