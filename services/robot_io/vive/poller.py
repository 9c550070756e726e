"""``python -m services.robot_io.vive.poller FD SERIAL``: polls SteamVR in a process of its own.

SteamVR's client is native code that may hang or crash, and SteamVR ends clients that do not leave
in time when it ends itself: nothing that a process which moves a robot should share. So robot_io
starts this as a child, and hears of poses over a socket that never blocks either of them.
"""

import os
import signal
import socket
import struct
import sys
import threading
import time
from collections.abc import Sequence

import msgspec

from services.robot_io.poses import Pose
from services.robot_io.vive.source import Sample, Status, ViveSource
from shared.clock import SystemClock

PERIOD = 0.004
"""A tracker's own stream is 250 Hz; a pose is computed when it is asked for, and has no stamp."""
REPORT_SECONDS = 0.25
POSE = struct.Struct("<8d")
"""A pose on its way: when (monotonic, s), position (m), orientation (w x y z)."""
MAX_BYTES = 8192


class Report(msgspec.Struct, frozen=True, kw_only=True):
    """What else there is to say."""

    status: Status
    counters: dict[str, int]


def packed(sample: Sample) -> bytes:
    """Return a pose as it travels."""
    return POSE.pack(sample.at, *sample.pose.position, *sample.pose.orientation)


def unpacked(data: bytes) -> Sample | Report | None:
    """Return what has travelled; None for what is neither."""
    if len(data) == POSE.size:
        at, x, y, z, a, b, c, d = POSE.unpack(data)
        return Sample(at, Pose((x, y, z), (a, b, c, d)))
    try:
        return msgspec.json.decode(data, type=Report)
    except (ValueError, RecursionError):
        return None


class Sender:
    """Sends what a source has; what does not fit is lost and counted."""

    def __init__(self, source: ViveSource, pipe: socket.socket) -> None:
        self._source = source
        self._pipe = pipe
        self._said: Status | None = None
        self._due_at = 0.0
        self._lost = 0

    def send(self, now: float) -> None:
        """Send the new poses, and a report when one is due.

        Raises:
            OSError: robot_io is gone.
        """
        for sample in self._source.take():
            self._send(packed(sample))
        status = self._source.status
        if status != self._said or now >= self._due_at:
            self._said, self._due_at = status, now + REPORT_SECONDS
            counters = dict(self._source.counters)
            counters["tracker_poses_lost"] += self._lost
            self._send(msgspec.json.encode(Report(status=status, counters=counters)))

    def _send(self, data: bytes) -> None:
        try:
            self._pipe.send(data, socket.MSG_DONTWAIT | socket.MSG_NOSIGNAL)
        except BlockingIOError:
            self._lost += 1


def watch(pipe: socket.socket) -> None:
    """End this process when robot_io closes its end or dies, whatever SteamVR is doing."""
    try:
        while pipe.recv(1):
            pass
    finally:
        os._exit(0)


def main(argv: Sequence[str] | None = None) -> int:
    """Poll until robot_io is gone."""
    from services.robot_io.vive.device import ViveDevice  # openvr

    number, serial = sys.argv[1:] if argv is None else argv
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # ^C is for robot_io, which then closes its end
    pipe = socket.socket(fileno=int(number))
    threading.Thread(target=watch, args=(pipe,), name="watch", daemon=True).start()
    clock = SystemClock()
    source = ViveSource(ViveDevice(), serial, clock)
    sender = Sender(source, pipe)
    due = clock.now()
    try:
        while True:
            source.poll()
            sender.send(now := clock.now())
            # A round that came late is left out: two poses at one moment tell no velocity.
            due = max(due + PERIOD, now + 0.5 * PERIOD)
            time.sleep(max(due - now, 0.0))
    except (BrokenPipeError, ConnectionError):
        return 0
    finally:
        source.close()


if __name__ == "__main__":
    sys.exit(main())
