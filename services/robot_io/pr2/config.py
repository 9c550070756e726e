"""Settings of the link to a PR2: section ``[pr2]`` of a site file."""

import msgspec

from shared.config.ranges import check_ranges


class Pr2Config(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Where the robot is, and what its controller must have been set up with."""

    master_uri: str = "http://pr2:11311"
    """The robot's ROS master."""
    host: str = ""
    """Name or address under which the robot reaches this machine; empty finds the address that
    this machine has towards the master."""
    node: str = "/riposte_robot_io"
    """Name of this node; the master ends a node when another of its name comes."""
    controller: str = "r_cart"
    """The JTCartesianController that is commanded."""
    kp_trans: float = 800.0
    """Its stiffness as loaded (N/m); a difference keeps the robot from being armed."""
    kd_trans: float = 15.0
    """N s/m."""
    kp_rot: float = 80.0
    """N m/rad."""
    kd_rot: float = 1.2
    """N m s/rad."""
    pose_command_filter: float = 0.01
    """Share of the way to a new command in each millisecond."""
    vel_saturation_trans: float = 1.0
    """m/s; times kd_trans it is the largest static force: 15 N. A stock robot has 2.0."""
    vel_saturation_rot: float = 4.0
    """rad/s."""
    clock_offset: float = 0.005
    """The robot's clock may be so far from ours (s)."""
    diagnostics_ignored: tuple[str, ...] = ()
    """Beginnings of the names in /diagnostics whose errors do not matter here."""

    def __post_init__(self) -> None:
        """Check the ranges.

        Raises:
            ValueError: a value is out of its range; says which, and what is allowed.
        """
        check_ranges(
            self,
            ("kp_trans", 1.0, 2000.0), ("kd_trans", 0.1, 100.0), ("kp_rot", 0.1, 500.0),
            ("kd_rot", 0.01, 20.0), ("pose_command_filter", 1e-4, 1.0),
            ("vel_saturation_trans", 0.05, 2.0), ("vel_saturation_rot", 0.1, 8.0),
            ("clock_offset", 1e-4, 1.0),
        )  # fmt: skip
