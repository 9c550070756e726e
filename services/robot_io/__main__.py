"""``python -m services.robot_io``: the process that moves a robot; its loop keeps time itself."""

import sys
import threading
from collections.abc import Callable, Sequence

import msgspec

from services.robot_io.config import RobotIoConfig, SafetyConfig
from services.robot_io.extras import open_extras
from services.robot_io.gate import Gate
from services.robot_io.poses import Pose, pose_of
from services.robot_io.pr2.config import Pr2Config
from services.robot_io.scene import OpenVive, blade_of, person_tracker
from services.robot_io.service import Parts, RobotIo
from services.robot_io.trackers import PolicyTracker, Tracker
from services.robot_io.twin import TwinLink
from services.robot_io.vive.config import ViveConfig
from shared.bus.base import Bus
from shared.clock import Clock
from shared.errors import ConfigError
from shared.runtime.serve import ServeArgs, serve
from shared.runtime.service import StatusReporter
from shared.sim.config import SimConfig
from shared.sim.model import FencingModel
from shared.sim.twin import Twin, command_of

SWITCH_SECONDS = 0.0005
"""A busy thread (a long message, a strap that connects) lets the loop go on after so long; Python's
own is 5 ms, at each lock that the loop comes back to."""


def build(args: ServeArgs, bus: Bus, clock: Clock) -> RobotIo:
    """Return the loop that the command line asks for."""
    cfg = args.section("robot_io", RobotIoConfig)
    safety = args.section("safety", SafetyConfig)
    sim = args.section("sim", SimConfig)
    open_vive = vive_of(args, bus, clock)
    if cfg.link == "pr2":
        make = pr2_parts_maker()
        pr2 = args.section("pr2", Pr2Config)
        parts = make(cfg, pr2, safety, sim, bus, clock, open_vive)
    else:
        parts = twin_parts(cfg, safety, sim, bus, open_vive)
    parts = msgspec.structs.replace(parts, extras=open_extras(args, bus, clock))
    return RobotIo(cfg, parts, sim.control_timestep, bus, clock)


def pr2_parts_maker() -> Callable[..., Parts]:
    """Return what opens the link to a PR2; rosbags only where one is wanted.

    Raises:
        ConfigError: it is not installed.
    """
    try:
        from services.robot_io.pr2.parts import pr2_parts
    except ModuleNotFoundError as error:
        raise ConfigError(
            f"link = 'pr2' needs {error.name}: pip install 'riposte[robot]'"
        ) from error
    return pr2_parts


def vive_of(args: ServeArgs, bus: Bus, clock: Clock) -> OpenVive:
    """Return what opens the tracker of section ``[vive]``."""

    def open_it(world_from_torso: Pose, start: Pose) -> Tracker:
        try:
            from services.robot_io.vive.tracker import (
                open_vive,  # openvr only where a tracker is wanted
            )
        except ModuleNotFoundError as error:
            raise ConfigError(
                f"tracker = 'vive' needs {error.name}: pip install 'riposte[robot]'"
            ) from error
        return open_vive(args.section("vive", ViveConfig), world_from_torso, start, bus, clock)

    return open_it


def twin_parts(
    cfg: RobotIoConfig, safety: SafetyConfig, sim: SimConfig, bus: Bus,
    open_vive: OpenVive | None = None,
) -> Parts:  # fmt: skip
    """Return a twin, its gate and whoever plays against it."""
    model = FencingModel.build(sim)
    is_robot = cfg.tracker == "policy"
    twin = Twin(
        model, command_of(cfg.twin_filter, cfg.twin_delay), cfg.twin_force, person=not is_robot
    )
    link = TwinLink(twin)
    return Parts(
        gate=Gate(safety, blade_of(model), sim.control_timestep),
        link=link,
        tracker=PolicyTracker(link) if is_robot else person_tracker(cfg, model, bus, open_vive),
        home=pose_of(twin.tools()[1]),
        other_home=pose_of(twin.tools()[0]) if is_robot else None,
        other=link if is_robot else None,
        person=None if is_robot else link,
        put_back=twin.reset,
    )


def run(service: RobotIo, bus: Bus, clock: Clock, args: ServeArgs, stop: threading.Event) -> None:
    """Tick at absolute deadlines, and whenever something arrives, until ``stop`` is set."""
    bus.declare_alive(args.role)
    reporter = StatusReporter(service, bus, clock, args.role)
    while not stop.is_set():
        service.tick()
        reporter.tick()
        bus.wait(max(service.due_at - clock.now(), 0.0))


def main(argv: Sequence[str] | None = None) -> int:
    """Run the loop until it is told to stop; return the exit code."""
    sys.setswitchinterval(SWITCH_SECONDS)
    return serve("robot-io", build, argv, loop=run)  # closing the service holds the robot


if __name__ == "__main__":
    sys.exit(main())
