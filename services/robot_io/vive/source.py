"""Follows one tracker in SteamVR: reaches it, finds the tracker, asks where it is."""

from collections import deque
from collections.abc import Mapping
from typing import NamedTuple, Protocol

import msgspec

from services.robot_io.poses import Pose
from shared.clock import Clock
from shared.errors import RobotFault

PERIOD = 0.004
"""A tracker's own stream is 250 Hz; a pose is computed when it is asked for, and has no stamp."""
RETRY_SECONDS = 1.0
"""From one try to reach SteamVR to the next."""
SEARCH_SECONDS = 1.0
"""The same for a tracker that is not there; also from one look at the battery to the next."""
EVENT_SECONDS = 0.1
KEPT = 64
"""Poses that wait to be taken; of more the oldest go."""


class SteamVrError(RobotFault):
    """SteamVR cannot be used, now or ever; its text says what to do."""

    def __init__(self, text: str, *, is_final: bool = False) -> None:
        super().__init__(text)
        self.is_final = is_final
        """Whether waiting does not help."""


class Sighting(NamedTuple):
    """What SteamVR says of the tracker at one moment."""

    pose: Pose | None
    """Tracker in the base stations' frame; None where it is not tracked well."""
    is_connected: bool
    result: int


class Device(Protocol):
    """What is asked of SteamVR; see ``ViveDevice``."""

    def open(self) -> str: ...  # noqa: D102
    def find(self, serial: str) -> bool: ...  # noqa: D102
    def seen(self) -> tuple[str, ...]: ...  # noqa: D102
    def poll(self) -> Sighting: ...  # noqa: D102
    def battery(self) -> float | None: ...  # noqa: D102
    def is_ending(self) -> bool: ...  # noqa: D102
    def close(self) -> None: ...  # noqa: D102


class Source(Protocol):
    """Where poses come from; nothing here may block."""

    @property
    def counters(self) -> Mapping[str, int]:
        """Return what was counted since the start."""
        ...

    @property
    def status(self) -> "Status":
        """Return how it goes."""
        ...

    def take(self) -> "list[Sample]":
        """Return the poses since the last time, oldest first."""
        ...

    def close(self) -> None:
        """Let go of the device."""
        ...


class Sample(NamedTuple):
    """A pose that counts."""

    at: float
    """When it was asked for, by our monotonic clock (s)."""
    pose: Pose
    """Tracker in the base stations' frame."""


class Status(msgspec.Struct, frozen=True, kw_only=True):
    """How it goes."""

    problem: str
    """Why there are no poses; empty while there are."""
    is_connected: bool = False
    battery: float | None = None
    """0 to 1, where the tracker tells."""
    is_final: bool = False
    """Whether it never will work."""
    polls_per_s: float = 0.0
    """How often the tracker was asked for, over the last second."""


class ViveSource:
    """The tracker of one serial; it is polled by whoever owns it."""

    def __init__(self, device: Device, serial: str, clock: Clock) -> None:
        self._device = device
        self._serial = serial
        self.clock = clock
        """Stamps the poses."""
        self._samples: deque[Sample] = deque(maxlen=KEPT)
        self._is_open = self._is_found = False
        self._rated = (clock.now(), 0)
        self._retry_at = self._search_at = self._events_at = self._battery_at = clock.now()
        self.status = Status(problem="SteamVR has not answered yet")
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
            self._retry_at = now + RETRY_SECONDS
            self.status = Status(problem=str(error), is_final=error.is_final)

    def take(self) -> list[Sample]:
        """Return the poses since the last time, oldest first."""
        taken: list[Sample] = []
        while self._samples and len(taken) < KEPT:
            taken.append(self._samples.popleft())
        return taken

    def close(self) -> None:
        """Let go of SteamVR."""
        self._device.close()

    def _open(self, now: float) -> None:
        if now < self._retry_at or self.status.is_final:
            return
        self._device.open()
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
        self.status = Status(problem=problem)

    def _find(self, now: float) -> None:
        if now < self._search_at:
            return
        self._search_at = now + SEARCH_SECONDS
        if self._device.find(self._serial):
            self._is_found = True
            self._battery_at = now
            self._rated = (now, self.counters["tracker_polls"])
            return
        seen = ", ".join(self._device.seen()) or "none: switch it on, pair it in SteamVR"
        wanted = f"no tracker {self._serial}" if self._serial else "vive.serial names no tracker"
        self.status = Status(problem=f"{wanted}; SteamVR sees {seen}")

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
        battery, polls_per_s = self.status.battery, self.status.polls_per_s
        if now >= self._battery_at:
            self._battery_at = now + SEARCH_SECONDS
            battery = self._device.battery()
            (since, before), polls = self._rated, self.counters["tracker_polls"]
            self._rated = (at, polls)
            if at - since >= 0.5 * SEARCH_SECONDS:
                polls_per_s = (polls - before) / (at - since)
        if not found.is_connected:
            problem = f"the tracker {self._serial} is switched off or out of reach"
        elif found.pose is None:
            problem = (
                f"the base stations have lost the tracker {self._serial} (result {found.result})"
            )
        else:
            problem = ""
        self.status = Status(
            problem=problem,
            is_connected=found.is_connected,
            battery=battery,
            polls_per_s=polls_per_s,
        )
