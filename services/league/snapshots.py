"""The snapshots of a run: one file each, named by the hash of its content, never changed."""

import hashlib
from pathlib import Path

from shared.errors import SnapshotError
from shared.messages.training import VersionReport
from shared.policy.snapshot import MAX_BYTES, Card, digest_of, unpack
from shared.runtime.files import atomic_write


class SnapshotStore:
    """``<folder>/<sha256>.safetensors``."""

    def __init__(self, folder: Path) -> None:
        """Make the folder if need be.

        Raises:
            SnapshotError: the folder cannot be made.
        """
        self._folder = folder
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise SnapshotError(
                f"snapshot folder {folder} cannot be made ({error.strerror}); make it writable"
            ) from error

    @property
    def is_empty(self) -> bool:
        """Return whether no snapshot was ever stored."""
        return next(self._folder.glob("*.safetensors"), None) is None

    def put(self, report: VersionReport) -> Card:
        """Store a version's snapshot and return its card; one that is stored is left alone.

        Raises:
            SnapshotError: the payload is not what the report says, too large, or not a snapshot
                this build reads.
            RiposteError: it cannot be written; nothing is left behind.
        """
        digest = digest_of(f"sha256:{report.snapshot}")
        payload = report.payload.tobytes()
        card = unpack(payload, digest).card
        if (card.agent, card.policy_version) != (report.agent, report.policy_version):
            raise SnapshotError(
                f"snapshot {digest[:12]} is version {card.policy_version} of {card.agent}, "
                f"reported as version {report.policy_version} of {report.agent}"
            )
        path = self._path(digest)
        try:
            if path.read_bytes() == payload:
                return card
        except OSError:
            pass  # not there, or unreadable: write it (again)
        atomic_write(path, payload)
        return card

    def get(self, reference: str) -> bytes:
        """Return the snapshot of a player reference.

        Raises:
            SnapshotError: no reference, not stored, or damaged on disk.
        """
        digest = digest_of(reference)
        path = self._path(digest)
        try:
            with path.open("rb") as file:
                payload = file.read(MAX_BYTES + 1)
        except FileNotFoundError:
            raise SnapshotError(
                f"snapshot {digest[:12]} is not in {self._folder}; it was never reported here"
            ) from None
        except OSError as error:
            raise SnapshotError(f"snapshot {path} cannot be read ({error.strerror})") from error
        if (found := hashlib.sha256(payload).hexdigest()) != digest:
            raise SnapshotError(
                f"snapshot {path} is damaged (its content has hash {found[:12]}); "
                "restore it from a copy of the run"
            )
        return payload

    def _path(self, digest: str) -> Path:
        return self._folder / f"{digest}.safetensors"
