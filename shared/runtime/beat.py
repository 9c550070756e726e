"""A process says to whoever watches over it that its loop still turns.

To systemd through the socket it names (``Type=notify``, ``WatchdogSec=``, see sd_notify(3)); to
anything else through the time of its log file, which ``deploy/docker/riposte-alive`` looks at.
"""

import contextlib
import os
import socket
from pathlib import Path

READY, BEAT = b"READY=1", b"WATCHDOG=1"


class Beat:
    """One process's beat; nobody listening, a full disk or a lost file never stop it."""

    def __init__(self, log: Path | None = None) -> None:
        """Take the log file to touch, and systemd's socket from ``NOTIFY_SOCKET``."""
        self._log = log
        address = os.environ.get("NOTIFY_SOCKET", "")
        self._address = "\0" + address[1:] if address.startswith("@") else address
        self._is_ready = False

    def tick(self) -> None:
        """Beat once; the first time the process is ready."""
        if self._log is not None:
            with contextlib.suppress(OSError):
                os.utime(self._log)
        if self._address:
            word = BEAT if self._is_ready else READY + b"\n" + BEAT
            with (
                contextlib.suppress(OSError),
                socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_CLOEXEC) as notify,
            ):
                notify.setblocking(False)
                notify.sendto(word, self._address)
                self._is_ready = True
