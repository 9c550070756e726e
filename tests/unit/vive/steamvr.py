"""A device that says what a test wants; the real one is in the integration tests."""

from services.robot_io.poses import Pose
from services.robot_io.vive.source import Sighting


class Scripted:
    """A SteamVR with one tracker, at a pose or lost."""

    def __init__(self, pose: Pose | None) -> None:
        self.pose = pose

    def open(self) -> str:
        return "1"

    def find(self, serial: str) -> bool:
        return serial == "LHR-1"

    def seen(self) -> tuple[str, ...]:
        return ("LHR-1 (double)",)

    def poll(self) -> Sighting:
        return Sighting(self.pose, True, 200 if self.pose else 201)

    def battery(self) -> float | None:
        return 0.5

    def is_ending(self) -> bool:
        return False

    def close(self) -> None: ...
