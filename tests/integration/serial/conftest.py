import dataclasses
from pathlib import Path

import pytest

from tests.integration.serial.running import Remains, remains, run


@dataclasses.dataclass(frozen=True)
class Uninterrupted:
    """A run from start to end."""

    ticks: int
    remains: Remains


@pytest.fixture(scope="package")
def uninterrupted(tmp_path_factory: pytest.TempPathFactory) -> Uninterrupted:
    folder: Path = tmp_path_factory.mktemp("uninterrupted")
    ticks = run(folder)
    return Uninterrupted(ticks, remains(folder))
