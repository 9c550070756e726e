"""The process that polls SteamVR, as robot_io sees it: poses to take, and a child to keep alive."""

import os
import socket
import subprocess
import sys
import threading
import time
from collections import deque

import structlog

from services.robot_io.vive.poller import MAX_BYTES, unpacked
from services.robot_io.vive.source import KEPT, Sample, Status
from shared.errors import RobotFault
from shared.runtime.process import THREAD_LIMITS

START_SECONDS = 15.0
"""How long the start waits for the child's first word of SteamVR."""
AGAIN_SECONDS = 1.0
"""From a child's end to the next one."""
CLOSE_SECONDS = 2.0
BUFFER_BYTES = 1 << 15
"""Of what waits to be taken: some 50 poses, a fifth of a second."""
POLL_SECONDS = 0.02

log = structlog.get_logger()


class ViveChild:
    """A tracker that another process follows; ``take`` and ``status`` belong to one thread."""

    def __init__(self, serial: str) -> None:
        """Start the process, and wait for what SteamVR says first.

        Raises:
            RobotFault: SteamVR can never be used here; says what to do.
        """
        self._serial = serial
        self._stop = threading.Event()
        self._fresh: deque[socket.socket] = deque(maxlen=1)
        self._pipe: socket.socket | None = None
        self._child: subprocess.Popen[bytes] | None = None
        self._status = Status(problem="the process that polls SteamVR is starting")
        self._counted: dict[str, int] = {}
        self._before = {"tracker_polls": 0}
        self._restarts = 0
        self._samples: list[Sample] = []
        self._thread = threading.Thread(target=self._keep, name="vive", daemon=True)
        self._thread.start()
        self._wait_for_word()

    @property
    def status(self) -> Status:
        """Return how it goes, as of the last ``take``."""
        return self._status

    @property
    def counters(self) -> dict[str, int]:
        """Return what was counted since the start, over all children."""
        return {**self._total(), "tracker_restarts": self._restarts}

    def take(self) -> list[Sample]:
        """Return the poses since the last time, oldest first; 5 µs each, never waits."""
        samples, self._samples = self._samples, []
        for _ in range(KEPT):
            if self._pipe is None:
                if not self._fresh:
                    break
                self._pipe = self._fresh.popleft()
            try:
                data = self._pipe.recv(MAX_BYTES, socket.MSG_DONTWAIT)
            except BlockingIOError:
                break
            except OSError:
                data = b""
            if not data:
                self._let_go()
                continue
            found = unpacked(data)
            if isinstance(found, Sample):
                samples.append(found)
            elif found is not None:
                self._status, self._counted = found.status, found.counters
        return samples

    def close(self) -> None:
        """End the process, within some seconds; it may be stuck."""
        self._stop.set()
        self._let_go()
        while self._fresh:
            self._fresh.popleft().close()
        child = self._child
        if child is not None:
            try:
                child.wait(CLOSE_SECONDS)
            except subprocess.TimeoutExpired:
                child.kill()
        self._thread.join(CLOSE_SECONDS)

    def _let_go(self) -> None:
        """Take it that the child is gone, whose end is closed."""
        if self._pipe is not None:
            self._pipe.close()
            self._pipe = None
        self._before, self._counted = self._total(), {}
        self._status = Status(problem="the process that polls SteamVR has ended: see the log")

    def _total(self) -> dict[str, int]:
        names = {**self._before, **self._counted}
        return {name: self._before.get(name, 0) + self._counted.get(name, 0) for name in names}

    def _wait_for_word(self) -> None:
        until = time.monotonic() + START_SECONDS
        first = self._status
        while self._status is first and time.monotonic() < until:
            time.sleep(POLL_SECONDS)
            self._samples += self.take()
        status = self._status
        if status.is_final:
            self.close()
            raise RobotFault(status.problem)

    def _keep(self) -> None:
        """Start a child again and again, until closed."""
        while not self._stop.is_set():
            ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
            theirs.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, BUFFER_BYTES)
            number = theirs.fileno()
            words = [sys.executable, "-m", "services.robot_io.vive.poller", str(number)]
            child = subprocess.Popen(
                [*words, self._serial],
                pass_fds=(number,),
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                env=os.environ | THREAD_LIMITS,
            )
            theirs.close()
            self._child = child
            self._fresh.append(ours)
            code = child.wait()
            if self._stop.is_set():
                break
            self._restarts += 1
            log.error("vive_poller_ended", exit_code=code)
            self._stop.wait(AGAIN_SECONDS)
