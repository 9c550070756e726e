from pathlib import Path

import numpy as np
import pytest

from services.league.snapshots import SnapshotStore
from shared.errors import SnapshotError
from tests.unit.league.driving import snapshot, version_report

POLICY = snapshot("antagonist", 1, 0)
REPORT = version_report("antagonist", 1, 0)


def test_a_snapshot_comes_back_as_it_was(tmp_path: Path) -> None:
    store = SnapshotStore(tmp_path / "snapshots")
    assert store.is_empty
    store.put(REPORT)
    store.put(REPORT)
    assert not store.is_empty
    assert store.get(POLICY.reference) == POLICY.payload
    assert [path.name for path in (tmp_path / "snapshots").iterdir()] == [
        f"{POLICY.digest}.safetensors"
    ]


def test_a_damaged_snapshot_is_refused_and_mended_by_the_next_report(tmp_path: Path) -> None:
    store = SnapshotStore(tmp_path)
    store.put(REPORT)
    path = tmp_path / f"{POLICY.digest}.safetensors"
    path.write_bytes(POLICY.payload[:-1] + b"\x7f")
    with pytest.raises(SnapshotError, match="is damaged"):
        store.get(POLICY.reference)
    store.put(REPORT)
    assert store.get(POLICY.reference) == POLICY.payload


@pytest.mark.parametrize("reference", ["scripted:static", "sha256:../../etc/passwd", "", "sha256:"])
def test_what_is_no_reference_opens_no_file(tmp_path: Path, reference: str) -> None:
    with pytest.raises(SnapshotError, match="is no snapshot"):
        SnapshotStore(tmp_path).get(reference)


def test_a_payload_of_another_hash_is_not_stored(tmp_path: Path) -> None:
    store = SnapshotStore(tmp_path)
    fields = {name: getattr(REPORT, name) for name in REPORT.__struct_fields__}
    for payload in (np.zeros(0, np.uint8), np.zeros(5 << 20, np.uint8), REPORT.payload[:-3]):
        with pytest.raises(SnapshotError):
            store.put(type(REPORT)(**(fields | {"payload": payload})))
    assert store.is_empty


def test_a_folder_that_cannot_be_made_is_named(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(SnapshotError, match="cannot be made"):
        SnapshotStore(tmp_path / "file" / "snapshots")
