"""One locked router for all tests of this folder."""

import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.integration.security.locked import Locked, locked


@pytest.fixture(scope="session")
def site() -> Iterator[Locked]:
    memory = Path("/dev/shm")  # certificates are synced to their disk one by one
    with (
        tempfile.TemporaryDirectory(dir=memory if memory.is_dir() else None) as folder,
        locked(Path(folder)) as running,
    ):
        yield running
