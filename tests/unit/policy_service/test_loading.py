import os
from pathlib import Path

import msgspec
import pytest

from services.policy.__main__ import build, listed
from services.policy.config import PolicyConfig
from shared.bus.memory import MemoryHub
from shared.clock import ManualClock
from shared.errors import ConfigError, SnapshotError
from shared.policy.players import SnapshotPlayer
from shared.runtime.serve import parse_args
from tests.unit.policy.making import snapshot
from tests.unit.policy_service.driving import FIT, loader, store

OLD = snapshot(1, agent="protagonist", policy_version=3)
NEW = snapshot(2, agent="protagonist", policy_version=12)
OTHER = snapshot(3, agent="antagonist", policy_version=40)


def test_a_run_gives_the_newest_version_of_a_side(tmp_path: Path):
    store(tmp_path, NEW, OLD, OTHER)
    found = loader("protagonist", tmp_path / "elsewhere").load(f"{tmp_path}:protagonist")
    assert found.reference == NEW.reference
    assert isinstance(found.player, SnapshotPlayer)
    assert not found.player.stochastic


def test_a_hash_is_looked_up_in_the_folder_of_this_run(tmp_path: Path):
    store(tmp_path, NEW, OLD)
    assert loader("protagonist", tmp_path).load(OLD.reference).reference == OLD.reference
    with pytest.raises(SnapshotError, match=r"cannot be read \(No such file"):
        loader("protagonist", tmp_path).load(OTHER.reference)


def test_a_file_is_known_by_its_hash(tmp_path: Path):
    path = tmp_path / "x.safetensors"
    path.write_bytes(NEW.payload)
    assert loader("protagonist", tmp_path).load(str(path)).reference == NEW.reference


def test_a_snapshot_of_another_name_than_its_hash_is_refused(tmp_path: Path):
    store(tmp_path, NEW)
    stored = tmp_path / "snapshots" / f"{NEW.digest}.safetensors"
    stored.rename(stored.with_stem(OLD.digest))
    for text in (OLD.reference, f"{tmp_path}:protagonist"):
        with pytest.raises(SnapshotError, match="damaged: its hash is"):
            loader("protagonist", tmp_path).load(text)


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"agent": "antagonist"}, "its agent is antagonist, this process plays the protagonist"),
        ({"observation_schema": "0" * 16}, "its observation_schema is 0000000000000000, this"),
        ({"action_schema": "1" * 16}, "its action_schema is 1111111111111111, this"),
        ({"control_timestep": 0.02}, "its control_timestep is 0.02, this process needs 0.01"),
        ({"offset_bound_rad": 0.1}, "its offset_bound_rad is 0.1, this process needs 0.06"),
        ({"model": "a" * 64}, "its model is aaaa"),
    ],
)
def test_what_does_not_fit_is_refused_by_its_field(change, reason: str, tmp_path: Path):
    path = tmp_path / "x.safetensors"
    path.write_bytes(snapshot(**{"agent": "protagonist"} | change).payload)
    fit = msgspec.structs.replace(FIT, model="m" * 64)
    with pytest.raises(SnapshotError) as caught:
        loader("protagonist", tmp_path, fit).load(str(path))
    assert reason in str(caught.value)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("scripted:nobody", "there is no player 'scripted:nobody'; scripted players: scripted:"),
        ("nowhere.safetensors", "cannot be read (No such file or directory); give scripted:NAME"),
        ("sha256:12", "is no snapshot; expected sha256:<64 hex digits>"),
        ("nowhere:protagonist", "nowhere holds no snapshot of the protagonist"),
        ("a\0b", "cannot be read"),
        (".", "cannot be read ("),
    ],
)
def test_who_cannot_be_found_is_said_in_one_line(text: str, reason: str, tmp_path: Path):
    with pytest.raises(SnapshotError) as caught:
        loader("protagonist", tmp_path).load(text)
    assert reason in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_fifo_stops_nobody(tmp_path: Path):
    os.mkfifo(tmp_path / "fifo")
    with pytest.raises(SnapshotError, match="cannot be read \\(no regular file\\)"):
        loader("protagonist", tmp_path).load(str(tmp_path / "fifo"))


def test_what_the_page_and_the_study_offer_may_be_asked_for(tmp_path: Path):
    site = tmp_path / "site.toml"
    site.write_text(
        '[policy]\nprotagonist = "mine"\n[page]\nport = 0\nplayers = [["a", "/paths/a"]]\n'
        '[study]\nplayers = [["b", "runs/b:protagonist"]]\n'
    )
    args = parse_args("policy", (str(site), "--run", str(tmp_path), "--agent", "protagonist"))
    found = listed(args, args.section("policy", PolicyConfig))
    assert found == {"scripted:stab", "mine", "/paths/a", "runs/b:protagonist"}


def built(*argv: str):
    clock = ManualClock()
    return build(parse_args("policy", argv), MemoryHub(clock).join("policy-0"), clock)


def test_the_command_line_says_which_side(tmp_path: Path):
    with pytest.raises(ConfigError, match="give --agent antagonist or --agent protagonist"):
        built("--run", str(tmp_path))
    policy = built("--run", str(tmp_path), "--agent", "antagonist")
    assert policy.health().state == "scripted:stab holds still, no bout runs, as antagonist"


def test_the_side_is_played_by_whom_its_setting_names(tmp_path: Path):
    store(tmp_path, NEW)
    player = f'policy.protagonist="{NEW.reference}"'
    argv = ("--run", str(tmp_path), "--agent", "protagonist", "--set", player)
    assert built(*argv).health().state.startswith(NEW.reference[:19])
    with pytest.raises(SnapshotError, match=f"its model is {'m' * 64}, this process needs 000"):
        built(*argv, "--set", f'policy.model="{"0" * 64}"')


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("protagonist", ""), ("model", "xyz"), ("stale_after", 0.0), ("referee_silence", 60.0),
        ("seed", -1),
    ],
)  # fmt: skip
def test_a_setting_out_of_range_is_named(field: str, value: object):
    with pytest.raises(ValueError, match=f"^{field}"):
        PolicyConfig(**{field: value})  # type: ignore[arg-type]
