"""Reads what Zenoh writes to stdout, so that its log becomes ours."""

import os
import threading

CHUNK_BYTES = 1 << 18
MOST_BYTES = 1 << 22
"""Kept until it is taken; under a flood of refusals the rest is thrown away."""


class LibraryLog:
    """Takes the stdout of this process, which the library writes to and nobody else does."""

    def __init__(self) -> None:
        """Begin to read; there is no way back, the process owns no other stdout."""
        self._lock = threading.Lock()
        self._kept = bytearray()
        self._thrown_away = 0
        reading, writing = os.pipe()
        os.dup2(writing, 1)
        os.close(writing)
        threading.Thread(target=self._read, args=(reading,), name="zenoh-log", daemon=True).start()

    def take(self) -> tuple[bytes, int]:
        """Return the whole lines that came since the last time, and how many bytes were lost."""
        with self._lock:
            end = self._kept.rfind(b"\n") + 1
            lines, self._kept = bytes(self._kept[:end]), self._kept[end:]
            lost, self._thrown_away = self._thrown_away, 0
        return lines, lost

    def _read(self, descriptor: int) -> None:
        while chunk := os.read(descriptor, CHUNK_BYTES):
            with self._lock:
                if len(self._kept) < MOST_BYTES:
                    self._kept += chunk
                else:
                    self._thrown_away += len(chunk)
