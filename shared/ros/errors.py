"""What goes wrong between ROS nodes."""

from shared.errors import RobotFault


class RosError(RobotFault):
    """No master, no such service, no answer in time, or a refusal; says which and what to do."""
