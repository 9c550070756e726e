"""Stops, power and diagnostics, as far as they keep the robot from being moved."""

from collections.abc import Iterable, Mapping
from typing import Any, Final

import msgspec

RIGHT_ARM: Final = 1
"""Of the power board's circuits: base, right arm, left arm."""
ENABLED: Final = 3
BOARD_SILENT_SECONDS: Final = 1.0
MOTORS_SILENT_SECONDS: Final = 3.0
"""They say once a second whether they are halted."""
ERROR: Final = 2
"""Level of a diagnostic."""
DIAGNOSTIC_SECONDS: Final = 5.0
"""An error that was not repeated for so long is over."""
MOST_DIAGNOSTICS: Final = 2000
_STATES: Final = {0: "without power", 1: "in standby", 2: "pumping", 3: "enabled", 4: "disabled"}


class Board(msgspec.Struct, frozen=True, kw_only=True):
    """What the power board said last."""

    at: float
    """When, by our monotonic clock (s)."""
    is_stopped: bool
    """A run stop is pressed; while the wireless one is, the other cannot be observed."""
    is_wireless_stopped: bool
    circuit: int
    """State of the right arm's circuit."""

    @staticmethod
    def of(message: Any, at: float) -> "Board":
        """Return it as a ``pr2_msgs/PowerBoardState`` says it."""
        return Board(
            at=at,
            is_stopped=not message.run_stop,  # the message's true is "may run", for both
            is_wireless_stopped=not message.wireless_stop,
            circuit=int(message.circuit_state[RIGHT_ARM]),
        )


def board_problems(board: Board | None, now: float) -> list[str]:
    """Return what is wrong with the power, beside a stop that is pressed."""
    if board is None:
        return ["no word from /power_board/state yet: is power_node running on the robot?"]
    problems: list[str] = []
    if not now - board.at <= BOARD_SILENT_SECONDS:
        problems.append(f"the power board was silent for {now - board.at:.1f} s")
    if board.is_wireless_stopped:
        problems.append("the wireless stop is pressed")
    if board.circuit != ENABLED:
        state = _STATES.get(board.circuit, f"in state {board.circuit}")
        problems.append(f"the right arm's circuit is {state}: enable its breaker in the dashboard")
    return problems


def motors_problems(at: float | None, now: float) -> list[str]:
    """Return what is wrong with the word of the motors, which came at ``at`` (s)."""
    if at is None:
        return ["no word from /pr2_ethercat/motors_halted yet: is the robot started?"]
    if not now - at <= MOTORS_SILENT_SECONDS:
        return [f"/pr2_ethercat/motors_halted was silent for {now - at:.1f} s"]
    return []


class Diagnostics:
    """The errors that /diagnostics tells of."""

    def __init__(self, ignored: tuple[str, ...]) -> None:
        """Know of none.

        Args:
            ignored: beginnings of names that do not matter.
        """
        self._ignored = ignored
        self._errors: dict[str, tuple[float, str]] = {}

    def take(self, statuses: Iterable[Any], at: float) -> None:
        """Take the statuses of one message, which arrived at ``at`` (s)."""
        for status in statuses:
            name = str(status.name)
            if int(status.level) != ERROR or name.startswith(self._ignored or ("\0",)):
                self._errors.pop(name, None)
            elif len(self._errors) < MOST_DIAGNOSTICS:
                self._errors[name] = (at, str(status.message))

    def problems(self, now: float) -> list[str]:
        """Return the errors of the last seconds, two of them by name."""
        errors: Mapping[str, tuple[float, str]] = {
            name: (at, message)
            for name, (at, message) in self._errors.items()
            if now - at <= DIAGNOSTIC_SECONDS
        }
        self._errors = dict(errors)
        said = [f"diagnostics: {name}: {message}"[:160] for name, (_, message) in errors.items()]
        if len(said) > 2:
            return [*said[:2], f"diagnostics: {len(said) - 2} more errors"]
        return said
