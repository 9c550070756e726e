import subprocess
import sys
from pathlib import Path

import msgspec
import pytest

from shared.errors import SnapshotError
from shared.policy.snapshot import Snapshot
from shared.styles import bundle as bundles
from shared.styles.bundle import Bundle, BundlePlayer, load_bundle, save_bundle, shipped_bundle
from tests.unit.policy.making import snapshot

NAMES = ("warm-start", "style-1", "style-2", "style-3")


def made(first_seed: int = 0) -> tuple[Bundle, dict[str, Snapshot]]:
    snapshots = {
        name: snapshot(seed=first_seed + k, agent="protagonist") for k, name in enumerate(NAMES)
    }
    players = tuple(
        BundlePlayer(
            name=name,
            role="selected" if k else "warm_start",
            round=2 * k,
            seed=100 + k,
            sha256=snapshots[name].digest,
            style={"mean_velocity": 0.5 + 0.1 * k},
            spread={"mean_velocity": 0.01},
        )
        for k, name in enumerate(NAMES)
    )
    return Bundle(
        run="made-up", seed=3, trained_by="riposte train --phase all", commit="abc",
        selected_by="riposte styles runs/made-up", criterion="far apart", criterion_value=4.5,
        bouts=600, players=players,
    ), snapshots  # fmt: skip


def written(folder: Path, first_seed: int = 0) -> Bundle:
    bundle, snapshots = made(first_seed)
    save_bundle(folder, bundle, {s.digest: s.payload for s in snapshots.values()})
    return bundle


def test_what_was_saved_is_loaded_with_every_file_checked(tmp_path: Path):
    bundle = written(tmp_path / "bundle")
    found = load_bundle(tmp_path / "bundle")
    assert found.bundle == bundle
    assert list(found.snapshots) == list(NAMES)
    for player in bundle.players:
        assert found.snapshots[player.name].digest == player.sha256
        path = tmp_path / "bundle" / f"{player.sha256}.safetensors"
        assert path.read_bytes() == found.snapshots[player.name].payload
    assert bundle.player("style-2").reference == f"sha256:{found.snapshots['style-2'].digest}"


def test_a_new_bundle_replaces_an_old_one_and_its_files(tmp_path: Path):
    written(tmp_path)
    bundle = written(tmp_path, first_seed=2)  # two of the players stay
    assert {p.name for p in tmp_path.iterdir()} == {
        "bundle.toml",
        *(f"{player.sha256}.safetensors" for player in bundle.players),
    }
    assert load_bundle(tmp_path).bundle == bundle


def test_a_payload_that_is_not_its_hash_leaves_the_old_bundle_whole(tmp_path: Path):
    old = written(tmp_path)
    bundle, snapshots = made(first_seed=9)
    payloads = {s.digest: s.payload for s in snapshots.values()}
    payloads[bundle.players[3].sha256] = b"something else"
    with pytest.raises(SnapshotError, match="file of style-3 is not snapshot"):
        save_bundle(tmp_path, bundle, payloads)
    assert load_bundle(tmp_path).bundle == old


def edited(folder: Path, old: str, new: str) -> None:
    text = (folder / "bundle.toml").read_text()
    assert old in text
    (folder / "bundle.toml").write_text(text.replace(old, new, 1))


@pytest.mark.parametrize(
    ("old", "new", "complaint"),
    [
        ('run = "made-up"', 'run = "made-up"\nwhere = "there"', "unknown field `where`"),
        ("schema = 1", "schema = 7", "has schema 7, this build reads schema 1"),
        ('name = "style-1"', 'name = "style-2"', "one name twice: style-2"),
        ('name = "style-1"', 'name = "../etc"', "is no bundle"),
        ('role = "selected"', 'role = "warm_start"', "more than one warm_start"),
        ("seed = 3", 'seed = "three"', "Expected `int`, got `str`"),
        ("bouts = 600", "", "missing required field `bouts`"),
        ("[[players]]", "[[players", "is no bundle"),
    ],
)
def test_a_bundle_file_that_is_wrong_is_refused_in_one_line(
    tmp_path: Path, old: str, new: str, complaint: str
):
    written(tmp_path)
    edited(tmp_path, old, new)
    with pytest.raises(SnapshotError, match=r"bundle\.toml") as refused:
        load_bundle(tmp_path)
    assert complaint in str(refused.value)
    assert "\n" not in str(refused.value)


def test_missing_and_damaged_files_are_named(tmp_path: Path):
    bundle = written(tmp_path)
    path = tmp_path / f"{bundle.players[1].sha256}.safetensors"
    payload = path.read_bytes()
    path.write_bytes(payload[:-1] + bytes([payload[-1] ^ 1]))
    with pytest.raises(SnapshotError, match="the file of style-1 is damaged"):
        load_bundle(tmp_path)
    path.unlink()
    with pytest.raises(SnapshotError, match="no file for style-1"):
        load_bundle(tmp_path)
    with pytest.raises(SnapshotError, match="holds no bundle"):
        load_bundle(tmp_path / "nowhere")


def test_an_antagonist_is_no_player_of_a_bundle(tmp_path: Path):
    bundle, snapshots = made()
    intruder = snapshot(seed=1, agent="antagonist")
    player = msgspec.structs.replace(bundle.players[1], sha256=intruder.digest)
    players = (bundle.players[0], player, *bundle.players[2:])
    payloads = {s.digest: s.payload for s in (*snapshots.values(), intruder)}
    save_bundle(tmp_path, msgspec.structs.replace(bundle, players=players), payloads)
    with pytest.raises(SnapshotError, match="style-1 is the antagonist's policy"):
        load_bundle(tmp_path)


def test_an_unknown_player_is_answered_with_those_there_are():
    with pytest.raises(SnapshotError, match="no player 'best'; it has warm-start, style-1"):
        made()[0].player("best")


def test_the_bundle_that_comes_with_riposte_is_whole():
    folder = Path(bundles.__file__).parent / "data" / "bundle"
    if not folder.exists():
        pytest.skip("no bundle in this checkout")
    assert shipped_bundle() == folder
    assert len(load_bundle(folder).snapshots) == 4


def test_an_installation_without_a_bundle_says_how_to_make_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr(bundles.resources, "files", lambda name: tmp_path)
    with pytest.raises(SnapshotError, match="no bundle came with this installation"):
        shipped_bundle()
    written(tmp_path / "data" / "bundle")
    assert shipped_bundle() == tmp_path / "data" / "bundle"


def test_reading_a_bundle_needs_no_library_for_statistics():
    code = (
        "import sys; from shared.styles import bundle; "
        "heavy = {'sklearn', 'scipy', 'pyarrow', 'onnx', 'torch'} & set(sys.modules); "
        "assert not heavy, heavy"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=30)
    assert done.returncode == 0, done.stderr


def test_the_bundle_that_ships_is_a_warm_start_and_three_styles_with_their_origin():
    bundle = load_bundle(shipped_bundle()).bundle
    assert [player.role for player in bundle.players] == ["warm_start", *["selected"] * 3]
    assert bundle.trained_by.startswith("riposte train --phase all")
    assert len({player.sha256 for player in bundle.players}) == 4
