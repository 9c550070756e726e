"""Looks for private keys where none may be."""

from pathlib import Path

from rerun.chunk import RrdReader

from shared.messages.topics import ROLES


def assert_no_secret(folders: list[Path], written: Path, said: str) -> None:
    """Check that no line of any private key is in any file of a folder, or in a text.

    A recording is compressed: it is read, too.
    """
    keys = [path for folder in folders for path in folder.rglob("*.key")]
    assert len(keys) > len(ROLES)
    secrets = {line for key in keys for line in key.read_bytes().splitlines() if b"--" not in line}
    files = [path for path in written.rglob("*") if path.is_file()]
    assert files
    for data in (said.encode(), *(path.read_bytes() for path in files)):
        _check(data, secrets)
    for path in written.rglob("*.rrd"):
        rows = 0
        for chunk in RrdReader(path).stream():
            rows += chunk.num_rows
            _check(str(chunk.to_record_batch().to_pydict()).encode(), secrets)
        assert rows, path


def _check(data: bytes, secrets: set[bytes]) -> None:
    assert b"PRIVATE KEY" not in data
    assert not any(secret in data for secret in secrets)
