"""Follows one tracker in SteamVR, 250 times a second, beside the loop and never in its way."""

import threading
from collections import deque
from typing import NamedTuple, Protocol

import msgspec
import structlog

from services.robot_io.poses import Pose
from services.robot_io.vive_device import Sighting, SteamVrError
from shared.clock import Clock

PERIOD = 0.004
"""A tracker's own stream is 250 Hz; a pose is computed when it is asked for, and has no stamp."""
RETRY_SECONDS = 1.0
"""From one try to reach SteamVR to the next."""
SEARCH_SECONDS = 1.0
"""The same for a tracker that is not there; also from one look at the battery to the next."""
EVENT_SECONDS = 0.1
KEPT = 64
"""Poses that wait to be taken; of more the oldest go."""
OPEN_SECONDS = 10.0
"""How long the start waits for SteamVR's first word."""
JOIN_SECONDS = 3.0

log = structlog.get_logger()


class Device(Protocol):
    """What is asked of SteamVR; see ``ViveDevice``."""

    def open(self) -> str: ...  # noqa: D102
    def find(self, serial: str) -> bool: ...  # noqa: D102
    def seen(self) -> tuple[str, ...]: ...  # noqa: D102
    def poll(self) -> Sighting: ...  # noqa: D102
    def battery(self) -> float | None: ...  # noqa: D102
    def is_ending(self) -> bool: ...  # noqa: D102
    def close(self) -> None: ...  # noqa: D102


class Sample(NamedTuple):
    """A pose that counts."""

    at: float
    """When it was asked for, by our monotonic clock (s)."""
    pose: Pose
    """Tracker in the base stations' frame."""


class Status(msgspec.Struct, frozen=True, kw_only=True):
    """How it goes; replaced as a whole, so that another thread may read it."""

    problem: str
    """Why there are no poses; empty while there are."""
    is_connected: bool = False
    battery: float | None = None
    """0 to 1, where the tracker tells."""


class ViveSource:
    """The tracker of one serial; ``poll`` belongs to one thread, the rest to any."""

    def __init__(self, device: Device, serial: str, clock: Clock) -> None:
        self._device = device
        self._serial = serial
        self.clock = clock
        """Stamps the poses."""
        self._samples: deque[Sample] = deque(maxlen=KEPT)
        self._is_open = self._is_found = False
        self._retry_at = self._search_at = self._events_at = self._battery_at = clock.now()
        self.status = Status(problem="SteamVR has not answered yet")
        self.failure: SteamVrError | None = None
        """Why it never will work."""
        self.counters = {
            "tracker_polls": 0,
            "tracker_poses": 0,
            "tracker_bad_poses": 0,
            "tracker_poses_lost": 0,
            "steamvr_opened": 0,
        }

    def poll(self) -> None:
        """Do one round: reach SteamVR, find the tracker, or ask where it is."""
        now = self.clock.now()
        try:
            if not self._is_open:
                self._open(now)
            elif now >= self._events_at and self._ends(now):
                self._leave(now, "SteamVR has ended: start it again")
            elif not self._is_found:
                self._find(now)
            else:
                self._look(now)
        except SteamVrError as error:
            self.failure = error if error.is_final else None
            self._retry_at = now + RETRY_SECONDS
            self._say(Status(problem=str(error)))

    def take(self) -> list[Sample]:
        """Return the poses since the last time, oldest first."""
        taken: list[Sample] = []
        while self._samples and len(taken) < KEPT:
            taken.append(self._samples.popleft())
        return taken

    def close(self) -> None:
        """Let go of SteamVR; on the thread that polls."""
        self._device.close()

    def _open(self, now: float) -> None:
        if now < self._retry_at or self.failure is not None:
            return
        version = self._device.open()
        log.info("steamvr_opened", version=version)
        self.counters["steamvr_opened"] += 1
        self._is_open, self._is_found = True, False
        self._search_at = now
        self._find(now)

    def _ends(self, now: float) -> bool:
        self._events_at = now + EVENT_SECONDS
        return self._device.is_ending()

    def _leave(self, now: float, problem: str) -> None:
        self._device.close()
        self._is_open = self._is_found = False
        self._retry_at = now + RETRY_SECONDS
        self._say(Status(problem=problem))

    def _find(self, now: float) -> None:
        if now < self._search_at:
            return
        self._search_at = now + SEARCH_SECONDS
        if self._device.find(self._serial):
            self._is_found = True
            self._battery_at = now
            return
        seen = ", ".join(self._device.seen()) or "none: switch it on, pair it in SteamVR"
        wanted = f"no tracker {self._serial}" if self._serial else "vive.serial names no tracker"
        self._say(Status(problem=f"{wanted}; SteamVR sees {seen}"))

    def _look(self, now: float) -> None:
        found = self._device.poll()
        at = self.clock.now()
        self.counters["tracker_polls"] += 1
        if found.pose is not None:
            self.counters["tracker_poses"] += 1
            self.counters["tracker_poses_lost"] += len(self._samples) == KEPT
            self._samples.append(Sample(at, found.pose))
        else:
            self.counters["tracker_bad_poses"] += 1
        battery = self.status.battery
        if now >= self._battery_at:
            self._battery_at = now + SEARCH_SECONDS
            battery = self._device.battery()
        if not found.is_connected:
            problem = f"the tracker {self._serial} is switched off or out of reach"
        elif found.pose is None:
            problem = (
                f"the base stations have lost the tracker {self._serial} (result {found.result})"
            )
        else:
            problem = ""
        self._say(Status(problem=problem, is_connected=found.is_connected, battery=battery))

    def _say(self, status: Status) -> None:
        if status != self.status:
            self.status = status


class PollThread:
    """Polls a source at its rate until it is closed."""

    def __init__(self, source: ViveSource) -> None:
        """Start, and wait for the first word of SteamVR.

        Raises:
            SteamVrError: SteamVR can never be used here.
        """
        self._source = source
        self._stop = threading.Event()
        self._began = threading.Event()
        self._thread = threading.Thread(target=self._run, name="vive", daemon=True)
        self._thread.start()
        self._began.wait(OPEN_SECONDS)
        if source.failure is not None:
            self.close()
            raise source.failure

    def close(self) -> None:
        """Stop, and let go of SteamVR if it answers in time."""
        self._stop.set()
        self._thread.join(JOIN_SECONDS)

    def _run(self) -> None:
        clock = self._source.clock
        due = clock.now()
        try:
            while not self._stop.is_set():
                self._source.poll()
                self._began.set()
                # A round that came late is left out: two poses at one moment tell no velocity.
                due = max(due + PERIOD, clock.now() + 0.5 * PERIOD)
                self._stop.wait(due - clock.now())
        except Exception:  # the edge of the thread: without poses the gate holds the robot
            log.critical("vive_crashed", exc_info=True)
            self._source.status = Status(problem="the tracker's thread has crashed: see the log")
        finally:
            self._began.set()
            self._source.close()
