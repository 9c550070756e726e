"""`riposte robot calibrate`: where the Vive's base stations stand to the robot.

Nothing moves by itself: a person holds the gripper, with the tracker taped to it, in one pose
after another, and this takes each in which robot_io says that both stand still.
"""

import argparse
import contextlib
import datetime
import json
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from services.jobs.robot.command import place, place_arguments
from services.robot_io.poses import Vector
from services.robot_io.vive.calibration import (
    Calibration,
    Frame,
    load_calibration,
    save_calibration,
)
from services.robot_io.vive.config import ViveConfig
from services.robot_io.vive.hand_eye import LEAST_POSES, LEAST_SPREAD, HandEye, solve, spread_of
from services.robot_io.vive.pairs import Floats, PairCollector, Still, Which
from shared.bus.base import Bus
from shared.clock import Clock, SystemClock
from shared.errors import RobotFault
from shared.messages.topics import BATS, TRACKER_RAW
from shared.runtime.serve import open_site_bus
from shared.runtime.stop import stop_on_signals

POSES = 30
HEARD_SECONDS = 10.0
"""How long robot_io may take to be heard."""
POSE_SECONDS = 180.0
"""How long the person may take for the next pose."""
WAIT_SECONDS = 0.05
TAKE_MOST = 256
PROTAGONIST = 1
SEED = 0
"""Draws subsets of the poses: the same poses give the same calibration."""

LOST: dict[Which, str] = {
    "tracker": "is lost: turn it towards a base station",
    "tool": "is not known: does its controller run? riposte robot check tells",
}

Say = Callable[[str], None]


class Listener:
    """Hears robot_io say where tracker and tool are."""

    def __init__(self, bus: Bus, clock: Clock, say: Say, needed: Sequence[Which]) -> None:
        self._raws = bus.subscribe(TRACKER_RAW)
        self._bats = bus.subscribe(BATS)
        self._clock = clock
        self._heard_at = dict.fromkeys(needed, clock.now())
        self._is_lost: dict[Which, bool] = dict.fromkeys(needed, False)
        self.say = say
        self.progress_at = clock.now()
        """When the person got on; whoever listens moves it."""
        self.serial = ""

    def hear(self) -> list[tuple[Which, Floats | None]]:
        """Return the poses that have come, float64[7] each; None for one that is out of sight.

        Raises:
            RobotFault: robot_io is silent, or the person does not get on.
        """
        now = self._clock.now()
        heard: list[tuple[Which, Floats | None]] = []
        for _ in range(TAKE_MOST):
            if (raw := self._raws.take()) is None:
                break
            self.serial = raw.serial
            self._note("tracker", raw.is_valid)
            heard.append(("tracker", raw.pose if raw.is_valid else None))
        for _ in range(TAKE_MOST):
            if (states := self._bats.take()) is None:
                break
            is_there = bool(states.is_valid[PROTAGONIST])
            self._note("tool", is_there)
            heard.append(("tool", states.tools[PROTAGONIST] if is_there else None))
        for which, at in self._heard_at.items():
            if any(what == which for what, _ in heard):
                self._heard_at[which] = now
            elif now - at > HEARD_SECONDS:
                raise RobotFault(
                    f"robot_io says nothing of a {which} for {HEARD_SECONDS:g} s: is it running, "
                    "with tracker = 'vive' and its tracker switched on? riposte status tells"
                )
        if now - self.progress_at > POSE_SECONDS:
            raise RobotFault(f"no new pose for {POSE_SECONDS:g} s: nothing was written")
        return heard

    def close(self) -> None:
        """Stop listening."""
        self._raws.close()
        self._bats.close()

    def _note(self, which: Which, is_valid: bool) -> None:
        if self._is_lost.get(which, is_valid) != is_valid:
            return
        self._is_lost[which] = not is_valid
        what = f"tracker {self.serial}" if which == "tracker" else "robot's tool"
        self.say(f"the {what} is seen again" if is_valid else f"the {what} {LOST[which]}")


class Gathering:
    """Collects pairs of poses, and tells the person how far it is."""

    def __init__(self, bus: Bus, clock: Clock, say: Say, count: int) -> None:
        self._listener = Listener(bus, clock, say, ("tracker", "tool"))
        self._clock = clock
        self._count = count
        self._was_alike = False
        self.collector = PairCollector()

    @property
    def serial(self) -> str:
        """Return the tracker's."""
        return self._listener.serial

    def tick(self) -> bool:
        """Take what has come; return whether there are enough poses.

        Raises:
            RobotFault: robot_io is silent, or nobody moves the arm.
        """
        now = self._clock.now()
        for which, pose in self._listener.hear():
            if pose is None:
                self.collector.lose(which)
            else:
                self.collector.offer(which, pose, now)
        if self.collector.take(now) is not None:
            self._listener.progress_at = now
            taken, _ = self.collector.arrays()
            turned, least = np.rad2deg([spread_of(taken), LEAST_SPREAD])
            self._listener.say(
                f"pose {len(taken)} of {self._count}: turned by {turned:.0f} degrees so far "
                f"(RMS about its second axis, at least {least:.0f} are needed)"
            )
        elif self.collector.is_alike and not self._was_alike:
            self._listener.say("this pose is taken already: move on and turn the gripper")
        self._was_alike = self.collector.is_alike
        return len(self.collector.pairs) >= self._count

    def close(self) -> None:
        """Stop listening."""
        self._listener.close()


class Docking:
    """Waits until a tracker lies still, and says where that is."""

    def __init__(self, bus: Bus, clock: Clock, say: Say) -> None:
        self._listener = Listener(bus, clock, say, ("tracker",))
        self._clock = clock
        self._still = Still()
        self.dock: Vector | None = None
        """In the base stations' frame (m)."""

    def tick(self) -> bool:
        """Take what has come; return whether the place is known.

        Raises:
            RobotFault: robot_io is silent, or the bat is never laid down.
        """
        now = self._clock.now()
        for which, pose in self._listener.hear():
            if which == "tracker" and pose is None:
                self._still.lose()
            elif which == "tracker" and pose is not None:
                self._still.offer(pose, now)
        if (found := self._still.place(now)) is not None:
            x, y, z = (float(number) for number in found[:3])
            self.dock = (x, y, z)
        return self.dock is not None

    def close(self) -> None:
        """Stop listening."""
        self._listener.close()


def finish(task: Gathering | Docking, bus: Bus, is_stopped: Callable[[], bool]) -> None:
    """Tick until all is gathered.

    Raises:
        RobotFault: see ``tick``; or it was interrupted.
    """
    while not task.tick():
        if is_stopped():
            raise RobotFault("interrupted: nothing was written")
        bus.wait(WAIT_SECONDS)


def calibration_of(
    tracker: Floats, tool: Floats, serial: str, made_at: datetime.datetime
) -> Calibration:
    """Return the calibration of pairs of poses: float64[N, 7] each.

    Raises:
        Refused: it is not good enough; says why.
    """
    found: HandEye = solve(tracker, tool, np.random.default_rng(SEED))
    return Calibration(
        made_at=made_at,
        serial=serial,
        torso_from_base=_frame(found.torso_from_base),
        tracker_from_tool=_frame(found.tracker_from_tool),
        poses=int(found.used.sum()),
        rejected=int((~found.used).sum()),
        residual_mm=1e3 * found.residual,
        held_out_mm=1e3 * found.held_out,
        expected_mm=1e3 * found.expected,
        spread_deg=float(np.rad2deg(found.spread)),
    )


def main(argv: Sequence[str] | None = None) -> int:
    """Gather, solve, write; return 0 when the file is there."""
    found = _parse(sys.argv[1:] if argv is None else argv)
    where = place(found)
    cfg = where.section("vive", ViveConfig)
    path: Path = found.out or Path(cfg.calibration)
    before = load_calibration(path) if found.dock else None
    say: Say = (lambda text: print(text, file=sys.stderr)) if found.json else print
    clock = SystemClock()
    with stop_on_signals() as stop, contextlib.closing(open_site_bus(where, clock)) as bus:
        if before is not None:
            say("lay the bat, with its tracker, into its dock")
            with contextlib.closing(Docking(bus, clock, say)) as docking:
                finish(docking, bus, stop.is_set)
            made = msgspec.structs.replace(before, dock=docking.dock)
        else:
            say(
                f"{found.poses} poses: tape the tracker to the gripper, move the arm by hand, hold "
                "it still; turn the gripper by 35 degrees either way about every axis"
            )
            with contextlib.closing(Gathering(bus, clock, say, found.poses)) as gathering:
                finish(gathering, bus, stop.is_set)
            now = datetime.datetime.fromtimestamp(clock.wall_ns() // 10**9, datetime.UTC)
            made = calibration_of(*gathering.collector.arrays(), gathering.serial, now)
    save_calibration(path, made)
    if found.json:
        print(json.dumps({"file": str(path), **_plain(made)}))
    else:
        print("\n".join(lines(path, made)))
    return 0


def lines(path: Path, made: Calibration) -> list[str]:
    """Return a calibration as a person reads it."""
    if made.dock is not None:
        return [f"wrote the dock to {path}: restart robot_io"]
    return [
        f"poses         {made.poses} used, {made.rejected} left out",
        f"residual      {made.residual_mm:.1f} mm",
        f"held out      {made.held_out_mm:.1f} mm",
        f"expected      {made.expected_mm:.1f} mm within a metre of the robot's torso",
        f"turned        {made.spread_deg:.0f} degrees (RMS about the second axis)",
        f"wrote {path}: restart robot_io; then record the dock with riposte robot calibrate --dock",
    ]


def _parse(argv: Sequence[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="riposte robot calibrate",
        description="Finds where the Vive's base stations stand to the robot of a running site.",
    )
    place_arguments(parser)
    parser.add_argument(
        "--poses", type=int, default=POSES, metavar="N", help="how many (%(default)s)"
    )
    parser.add_argument(
        "--out", type=Path, metavar="FILE", help="file to write (vive.calibration of the site)"
    )
    parser.add_argument(
        "--dock", action="store_true",
        help="record where the bat lies in its dock, into the calibration there is",
    )  # fmt: skip
    parser.add_argument("--json", action="store_true", help="one JSON object")
    found = parser.parse_args(argv)
    if not LEAST_POSES <= found.poses <= 500:
        parser.error(f"--poses {found.poses}: expected {LEAST_POSES} to 500")
    return found


def _frame(seven: Floats) -> Frame:
    x, y, z, a, b, c, d = (float(number) for number in seven)
    return Frame(position=(x, y, z), orientation=(a, b, c, d))


def _plain(made: Calibration) -> dict[str, Any]:
    return msgspec.to_builtins(made)


if __name__ == "__main__":
    sys.exit(main())
