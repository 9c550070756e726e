"""A SteamVR that is none, under the real openvr wheel; skipped without a compiler or the wheel."""

import os
from collections.abc import Iterator
from pathlib import Path

import pytest

from shared.testing.fake_vive.runtime import (
    BASE_STATION,
    OVERRIDE,
    FakeVive,
    compile_client,
    has_compiler,
)

SERIAL = "LHR-00000001"


@pytest.fixture(scope="session")
def library(tmp_path_factory: pytest.TempPathFactory) -> Path:
    if not has_compiler():
        pytest.skip("gcc is not installed: the double of SteamVR cannot be built")
    pytest.importorskip("openvr", reason="openvr is not installed: riposte[robot]")
    return compile_client(tmp_path_factory.mktemp("vrclient"))


@pytest.fixture
def vive(library: Path, tmp_path: Path) -> Iterator[FakeVive]:
    """A SteamVR with one base station and one tracker, which this process finds."""
    fake = FakeVive(tmp_path / "steamvr", library)
    fake.put(1, "LHB-00000001", kind=BASE_STATION, model="Valve SR")
    fake.put(2, SERIAL)
    before = os.environ.get(OVERRIDE)
    os.environ[OVERRIDE] = str(fake.registry)
    yield fake
    os.environ.pop(OVERRIDE)
    if before is not None:
        os.environ[OVERRIDE] = before
    fake.close()
