"""Settings of robot_io: sections ``[robot_io]`` and ``[safety]`` of a site file."""

from typing import Literal

import msgspec

from shared.config.ranges import check_ordered, check_ranges

Vector = tuple[float, float, float]

LinkName = Literal["twin", "pr2"]
TrackerName = Literal["policy", "mouse", "vive", "replay"]


class SafetyConfig(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Limits of the safety gate; lengths and places in the robot's torso frame."""

    command_hold: float = 0.1
    """Without a usable command for so long, the robot slows down and holds (s)."""
    command_trip: float = 0.5
    """Without one for so long, the gate trips (s)."""
    state_hold: float = 0.05
    """Without the robot's state for so long, it holds (s)."""
    state_trip: float = 0.1
    """Without it for so long, the gate trips (s)."""
    tracker_hold: float = 0.1
    """Without the person's bat for so long, it holds (s)."""
    resume_after: float = 0.2
    """Everything must be in order for so long before a held robot moves again (s)."""
    rejects_trip: int = 10
    """So many unusable commands or states in a row trip the gate."""
    warm_up_speed: float = 0.25
    """Of the tool between bouts (m/s)."""
    game_speed: float = 0.6
    """Of the tool in a bout (m/s); 1.0 is the most there is."""
    acceleration: float = 6.0
    """Of the tool (m/s^2)."""
    turn_speed: float = 2.0
    """Of the tool's orientation (rad/s)."""
    turn_acceleration: float = 20.0
    """Of the tool's orientation (rad/s^2)."""
    ramp: float = 2.0
    """From arming to full speed (s)."""
    lead: float = 0.12
    """Furthest that a command may be from where the tool is (m)."""
    turn_lead: float = 0.5
    """The same of the orientation (rad)."""
    jump: float = 0.3
    """A command further than this from where the tool is, is refused, not clipped (m)."""
    box_low: Vector = (0.35, -0.75, -0.35)
    """Corner of the box that the tool stays in (m)."""
    box_high: Vector = (0.95, 0.45, 0.55)
    """The other corner (m)."""
    ceiling: float = 0.9
    """No point of the bat goes higher, for heads are above (m)."""
    keep_out: tuple[float, float] = (2.0, 0.0)
    """Where the person stands, x and y: axis of a cylinder that the bat stays out of (m)."""
    keep_out_radius: float = 0.4
    """Of that cylinder (m)."""
    force_trip: float = 40.0
    """More than this on the tool for ``force_seconds`` trips the gate (N)."""
    force_seconds: float = 0.05
    tracking_trip: float = 0.15
    """Further than this from its command for ``tracking_seconds`` trips the gate (m)."""
    tracking_seconds: float = 0.2
    effort_trip: float = 0.8
    """More than this share of a joint's effort limit for ``effort_seconds`` trips the gate."""
    effort_seconds: float = 0.1
    still_speed: float = 0.02
    """The robot may be armed when it moves less than this (m/s)."""

    def __post_init__(self) -> None:
        """Check the ranges.

        Raises:
            ValueError: a value is out of its range; says which, and what is allowed.
        """
        check_ranges(self, *_RANGES)
        check_ordered(self, *_ORDERED)
        for axis, low, high in zip("xyz", self.box_low, self.box_high, strict=True):
            if not -2.0 <= low < high <= 2.0:
                raise ValueError(
                    f"the box runs from {low} to {high} m along {axis}; "
                    "box_low must be below box_high, both within 2 m"
                )


_RANGES = (
    ("command_hold", 0.02, 0.5), ("command_trip", 0.02, 2.0), ("state_hold", 0.01, 0.5),
    ("state_trip", 0.01, 0.5), ("tracker_hold", 0.02, 0.5), ("resume_after", 0.05, 5.0),
    ("rejects_trip", 1, 50), ("warm_up_speed", 0.01, 0.6), ("game_speed", 0.01, 1.0),
    ("acceleration", 0.1, 20.0), ("turn_speed", 0.01, 4.0), ("turn_acceleration", 0.1, 60.0),
    ("ramp", 0.5, 10.0), ("lead", 0.01, 0.15), ("turn_lead", 0.05, 1.0), ("jump", 0.05, 1.0),
    ("ceiling", -1.0, 2.0), ("keep_out_radius", 0.0, 2.0), ("force_trip", 1.0, 100.0),
    ("force_seconds", 0.0, 0.5), ("tracking_trip", 0.02, 0.3), ("tracking_seconds", 0.0, 1.0),
    ("effort_trip", 0.1, 1.0), ("effort_seconds", 0.0, 1.0), ("still_speed", 0.001, 0.1),
)  # fmt: skip
_ORDERED = (
    ("command_hold", "command_trip"), ("state_hold", "state_trip"),
    ("warm_up_speed", "game_speed"), ("lead", "tracking_trip"),
)  # fmt: skip


class RobotIoConfig(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What stands on either side of the 100 Hz loop."""

    link: LinkName = "twin"
    """The robot: a simulated one in real time, or a PR2 (section ``[pr2]``)."""
    tracker: TrackerName = "policy"
    """Who plays against it: a second policy, the mouse of a browser, a Vive tracker on a person's
    bat (section ``[vive]``), or a recorded bat."""
    replay: str = ""
    """The recorded bat: a .npy file, float64[T, 14], a time (s) and 13 numbers each row; or the
    folder of an archived bout, RUN/bouts/NAME."""
    answer_wait: float = 0.005
    """Longest wait for the policy's answer within a tick before the command goes out (s)."""
    return_home: bool = True
    """Whether an armed robot goes back en garde between bouts, at warm-up speed."""
    referee_silence: float = 0.5
    """Without the referee for so long, no bout counts as running (s)."""
    twin_filter: float = 0.01
    """Of the twin's command, share a millisecond, where the model file has none; 1 is off."""
    twin_delay: float = 0.0075
    """The same, transport (s)."""
    twin_force: float = 15.0
    """Largest static force of the twin's controller: its Kd times velocity saturation (N)."""

    def __post_init__(self) -> None:
        """Check the ranges.

        Raises:
            ValueError: a value is out of its range; says which, and what is allowed.
        """
        check_ranges(
            self,
            ("answer_wait", 0.0, 0.008), ("referee_silence", 0.05, 5.0),
            ("twin_filter", 1e-4, 1.0), ("twin_delay", 0.0, 0.1), ("twin_force", 1.0, 100.0),
        )  # fmt: skip
        if self.link == "pr2" and self.tracker == "policy":
            raise ValueError(
                "link is 'pr2' and tracker is 'policy': against a PR2 plays a person; "
                "tracker may be 'vive', 'mouse' or 'replay'"
            )
        if (self.tracker == "replay") != bool(self.replay):
            raise ValueError(
                f"tracker is {self.tracker!r} and replay is {self.replay!r}: "
                "give a file with tracker = 'replay', and only there"
            )
