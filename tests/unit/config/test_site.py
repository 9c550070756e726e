from pathlib import Path

import msgspec
import pytest

from shared.config.site import dump, load_section, load_site
from shared.errors import ConfigError


class Rules(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    point: float = 1.0
    penalty: float = -10.0


class Sim(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    model: str = "nominal"
    num_envs: int = 64
    control_timestep: float = 0.01
    seed: int | None = None
    listen: tuple[str, ...] = ()
    rules: Rules = Rules()

    def __post_init__(self) -> None:
        if self.num_envs < 1:
            raise ValueError(f"num_envs ({self.num_envs}) must be at least 1")


SITE = """\
# a comment
[actor]
anything = 1

[sim]
model = "worn"
num_envs = 8
listen = ["a", "b"]

[sim.rules]
point = 2
"""


@pytest.fixture
def site(tmp_path: Path) -> Path:
    path = tmp_path / "site.toml"
    path.write_text(SITE, encoding="utf-8")
    return path


def test_no_file_gives_the_defaults():
    assert load_section(None, "sim", Sim) == Sim()


def test_a_section_is_read_and_other_sections_are_left_alone(site: Path):
    found = load_section(site, "sim", Sim)
    assert found == Sim(model="worn", num_envs=8, listen=("a", "b"), rules=Rules(point=2.0))


def test_overrides_come_last_and_reach_nested_tables(site: Path):
    overrides = ["sim.num_envs=16", "sim.model = plain-word", "sim.rules.penalty=-5.5", "game.x=1"]
    found = load_section(site, "sim", Sim, overrides)
    assert (found.num_envs, found.model) == (16, "plain-word")
    assert found.rules == Rules(point=2.0, penalty=-5.5)


def test_what_was_dumped_reads_back_equal(site: Path, tmp_path: Path):
    found = load_section(site, "sim", Sim)
    again = tmp_path / "again.toml"
    again.write_text(dump({"sim": found}), encoding="utf-8")
    assert load_section(again, "sim", Sim) == found


def test_several_sections_are_checked_at_once(site: Path):
    with pytest.raises(ConfigError, match=r"\[actor\] anything: unknown key"):
        load_site(site, {"sim": Sim, "actor": Sim})


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("[sim]", "[sims]", "site.toml:5: unknown section [sims]; did you mean 'sim'?"),
        ("num_envs = 8", "num_env = 8", "site.toml:7: [sim] num_env: unknown key; "
         "did you mean 'num_envs'?"),
        ("num_envs = 8", "num_envs = 'x'", "site.toml:7: [sim] num_envs: expected `int`, "
         "got `str`"),
        ("num_envs = 8", "num_envs = 0", "site.toml:7: [sim] num_envs (0) must be at least 1"),
        ("point = 2", "pint = 2", "site.toml:11: [sim] rules.pint: unknown key; "
         "did you mean 'point'?"),
        ("point = 2", "point = true", "site.toml:11: [sim] rules.point: expected `float`, "
         "got `bool`"),
        ('listen = ["a", "b"]', 'listen = ["a", 1]', "site.toml:8: [sim] listen: expected `str`"),
        ("[sim]", "[sim", "site.toml: not TOML"),
    ],
)  # fmt: skip
def test_a_mistake_is_answered_with_file_line_and_what_to_do(
    site: Path, old: str, new: str, message: str
):
    assert old in SITE
    site.write_text(SITE.replace(old, new), encoding="utf-8")
    with pytest.raises(ConfigError) as caught:
        load_section(site, "sim", Sim)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_value_where_a_section_belongs_is_refused(site: Path):
    site.write_text("sim = 1\n", encoding="utf-8")
    with pytest.raises(ConfigError, match=r"site\.toml:1: sim must be a section, \[sim\]"):
        load_section(site, "actor", Sim)


@pytest.mark.parametrize(
    ("override", "message"),
    [
        ("sim.num_env=1", "--set sim.num_env=1: [sim] num_env: unknown key"),
        ("sim.num_envs=0", "--set sim.num_envs=0: [sim] num_envs (0) must be at least 1"),
        ("simm.num_envs=1", "--set simm.num_envs=1: unknown section; did you mean 'sim'?"),
        ("sim.num_envs", "expected section.key=value"),
        ("num_envs=1", "expected section.key=value"),
        ("sim.model=two words", "is not a TOML value"),
        ("sim.model.deeper=1", "model is a value, not a table"),
    ],
)
def test_a_wrong_override_is_named(site: Path, override: str, message: str):
    with pytest.raises(ConfigError) as caught:
        load_section(site, "sim", Sim, [override])
    assert message in str(caught.value)


def test_a_missing_file_is_named(tmp_path: Path):
    with pytest.raises(ConfigError, match=r"cannot read site file .*none\.toml: No such file"):
        load_section(tmp_path / "none.toml", "sim", Sim)


def test_a_file_that_is_not_text_is_refused(tmp_path: Path):
    path = tmp_path / "binary.toml"
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(ConfigError, match="not UTF-8"):
        load_section(path, "sim", Sim)
