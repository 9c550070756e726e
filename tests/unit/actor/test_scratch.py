"""Folders of actors that joined: of those alive none goes, of those dead one stays."""

import os
import tempfile
from pathlib import Path

import pytest

from services.actor.scratch import Scratch, remove_stale


@pytest.fixture(autouse=True)
def temporary(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    return tmp_path


def dead(number: int) -> Path:
    """Return the folder of an actor that was killed, the later the higher its number."""
    made = Scratch()
    made._lock.close()  # as the kernel does
    (made.path / "logs").mkdir()
    os.utime(made.path, (number, number))
    return made.path


def test_only_the_newest_of_the_dead_is_kept_and_everybody_alive(temporary: Path):
    alive = Scratch()
    os.utime(alive.path, (5, 5))
    gone = [dead(1), dead(2), dead(3)]
    newest = dead(4)
    others = temporary / "riposte-actor-of-somebody"
    others.mkdir()
    (temporary / "riposte-actor-link").symlink_to(others)
    remove_stale()
    assert newest.exists()
    assert alive.path.exists()
    assert not any(path.exists() for path in gone)
    assert others.exists()
    remove_stale()
    assert newest.exists()
    alive.remove()
    assert not alive.path.exists()


def test_a_folder_that_is_just_being_made_is_left_alone(temporary: Path):
    (temporary / "riposte-joining-abc").mkdir()
    (temporary / "riposte-actor-abc").mkdir()
    remove_stale()
    assert len(list(temporary.iterdir())) == 2
