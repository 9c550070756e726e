"""The Vive tracker on a person's bat: from SteamVR's poses to a bat in the world."""

import importlib.util
from pathlib import Path

import numpy as np
import structlog

from services.robot_io.poses import Pose, length
from services.robot_io.trackers import LOST_SECONDS, Follower, TrackedBat
from services.robot_io.vive.calibration import Calibration, load_calibration
from services.robot_io.vive.child import ViveChild
from services.robot_io.vive.config import ViveConfig
from services.robot_io.vive.dock import DockCheck
from services.robot_io.vive.frames import composed
from services.robot_io.vive.source import Sample, Source
from shared.bus.base import Bus
from shared.clock import Clock
from shared.errors import ConfigError
from shared.messages.topics import TRACKER_RAW
from shared.messages.tracking import TrackerRaw

FLOWN_M = 4.0
"""A bat further than this from the target is not where it seems: an occluded tracker goes on by
dead reckoning, and flies off."""
HUNG_SECONDS = 1.0
"""Without a word of SteamVR for so long, it hangs."""
DROPOUT_SECONDS = 0.2
"""After a dropout longer than this the place of the tracker is to be checked in its dock."""

log = structlog.get_logger()


class ViveTracker:
    """The bat that a tracker is mounted on; without a usable calibration it is never tracked."""

    def __init__(
        self, cfg: ViveConfig, source: Source, world_from_torso: Pose, start: Pose,
        bus: Bus, clock: Clock,
    ) -> None:  # fmt: skip
        """Read the calibration.

        Args:
            cfg: settings.
            source: follows the tracker.
            world_from_torso: where the robot's torso frame stands.
            start: where the bat is shown until it is seen.
            bus: takes the raw poses, for a calibration.
            clock: tells the age of the calibration.
        """
        self._cfg = cfg
        self._source = source
        self._bus = bus
        self._clock = clock
        self._follower = Follower(start)
        self._raw: Sample | None = None
        self._seen_at: float | None = None
        self._counters = {"tracker_dropouts": 0, "tracker_flown": 0}
        self._uncalibrated = ""
        self._calibration: Calibration | None = None
        try:
            found = load_calibration(Path(cfg.calibration))
            found.check_age(clock.wall_ns(), cfg.calibration_days)
            self._calibration = found
        except ConfigError as error:
            self._uncalibrated = str(error)
        self._dock = DockCheck(
            self._calibration.dock if self._calibration else None, cfg.dock_limit
        )
        self._world_from_base = (
            composed(world_from_torso, self._calibration.torso_from_base.pose)
            if self._calibration
            else None
        )
        self._passed = (
            (f"the tracker is {self._calibration.describe(clock.wall_ns())}",)
            if self._calibration
            else ()
        )
        self._said = ""

    def read(self, now: float) -> TrackedBat:
        """Return the bat after all poses since the last time."""
        for sample in self._source.take():
            self._take(sample)
        self._publish_raw(now)
        tracked = self._follower.read(now)
        problem = self._problem(now)
        if problem != self._said:
            log.warning("tracker_problem", problem=problem) if problem else log.info("tracker_well")
            self._said = problem
        return TrackedBat(
            state=tracked.state,
            is_valid=tracked.is_valid and not self._dock.problem,
            seen_at=tracked.seen_at,
            problem=problem,
            passed=self._passed,
        )

    def rates(self) -> dict[str, float]:
        """Return how fast SteamVR is asked, and what it says of the tracker."""
        status = self._source.status
        rates = {
            "tracker_polls_per_s": status.polls_per_s,
            "tracker_connected": float(status.is_connected),
            "tracker_check_due": float(self._dock.is_due),
        }
        if status.battery is not None:
            rates["tracker_battery_percent"] = 100.0 * status.battery
        if self._dock.error is not None:
            rates["tracker_dock_error_mm"] = 1e3 * self._dock.error
        return rates

    def counters(self) -> dict[str, int]:
        """Return what was polled, left out and lost."""
        return {
            **self._source.counters,
            **self._counters,
            **self._dock.counters,
            "tracker_rejected": self._follower.rejected,
        }

    def close(self) -> None:
        """Let go of SteamVR."""
        self._source.close()

    def _take(self, sample: Sample) -> None:
        if self._seen_at is not None and sample.at - self._seen_at > LOST_SECONDS:
            self._counters["tracker_dropouts"] += 1
            if sample.at - self._seen_at > DROPOUT_SECONDS:
                self._dock.lost()
        self._seen_at, self._raw = sample.at, sample
        self._dock.offer(sample.pose.position, sample.at)
        if self._world_from_base is None:
            return
        tracker = composed(self._world_from_base, sample.pose)
        bat = composed(tracker, self._cfg.mount)
        x, y, _ = bat.position
        if length((x, y, 0.0)) > FLOWN_M:  # the target is at the world's middle
            self._counters["tracker_flown"] += 1
            return
        self._follower.offer(bat, sample.at)

    def _problem(self, now: float) -> str:
        """Return why the bat is not tracked, the first thing to mend first."""
        if self._source.status.problem:
            return self._source.status.problem
        if self._uncalibrated:
            return self._uncalibrated
        if self._dock.problem:
            return self._dock.problem
        if self._seen_at is None or now - self._seen_at > HUNG_SECONDS:
            return "no pose of the tracker arrives: restart SteamVR"
        return ""

    def _publish_raw(self, now: float) -> None:
        """Say where the tracker is in the base stations' frame; a calibration needs it."""
        raw = self._raw
        if raw is None:
            return
        is_valid = now - raw.at <= LOST_SECONDS and not self._source.status.problem
        said = TrackerRaw(
            at_ns=self._clock.wall_ns(),
            serial=self._cfg.serial,
            pose=np.array([*raw.pose.position, *raw.pose.orientation]),
            is_valid=is_valid,
        )
        self._bus.publish(TRACKER_RAW, said)


def open_vive(
    cfg: ViveConfig, world_from_torso: Pose, start: Pose, bus: Bus, clock: Clock
) -> ViveTracker:
    """Return the tracker, followed by a process of its own.

    Raises:
        ConfigError: openvr is not installed.
        RobotFault: SteamVR can never be used here; says what to do.
    """
    if importlib.util.find_spec("openvr") is None:
        raise ConfigError("tracker = 'vive' needs openvr: pip install 'riposte[robot]'")
    return ViveTracker(cfg, ViveChild(cfg.serial), world_from_torso, start, bus, clock)
