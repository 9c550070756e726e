"""Where the bout stands, as far as robot_io has to know: game time, and whether to go home."""

from services.robot_io.poses import Pose, add, rotation_between, shortened, turned, unit
from shared.bus.base import Bus
from shared.messages.play import RefereeState
from shared.messages.topics import REFEREE

HOME_STEP_M = 0.1
HOME_STEP_RAD = 0.3
"""How far ahead of the tool the way home is asked for."""
BETWEEN = ("ready", "finished", "void")


class Course:
    """What the referee said last."""

    def __init__(self, bus: Bus, silence: float, period: float) -> None:
        """Listen.

        Args:
            bus: this process's end of the bus.
            silence: without the referee for so long, no bout runs (s).
            period: from tick to tick (s).
        """
        self._said = bus.subscribe(REFEREE)
        self._silence = silence
        self._period = period
        self._state: RefereeState | None = None
        self._heard_at = 0.0

    def hear(self, now: float) -> bool:
        """Take what has arrived; return whether anything did."""
        if (state := self._said.take()) is None:
            return False
        self._state, self._heard_at = state, now
        return True

    def seconds(self, tick: int, now: float) -> float:
        """Return the game time at a tick (s); 0 outside a bout."""
        state = self._state
        if state is None or state.phase != "running" or now - self._heard_at > self._silence:
            return 0.0
        return state.seconds + max(tick - 1 - state.tick, 0) * self._period

    @property
    def speed(self) -> float:
        """Return the share of its speed that the tool may have, as the referee said last."""
        speed = self._state.speed if self._state is not None else 1.0
        return speed if 0.0 <= speed <= 1.0 else 0.0

    @property
    def is_between(self) -> bool:
        """Return whether there is a referee, and no bout."""
        return self._state is not None and self._state.phase in BETWEEN

    def close(self) -> None:
        """Stop listening."""
        self._said.close()


def way_home(home: Pose, measured: Pose) -> Pose:
    """Return the next place on the way home."""
    way = shortened(add(home.position, measured.position, -1.0), HOME_STEP_M)
    turn = rotation_between(measured.orientation, home.orientation)
    orientation = turned(unit(measured.orientation), shortened(turn, HOME_STEP_RAD))
    return Pose(add(measured.position, way), orientation)
