"""What happens to a command before the servo sees it: transport delay, then the filter.

The PR2's controller moves its filtered command once per 1 ms cycle by a fixed share ``a`` of
what is left: positions on a straight line, orientations on the great arc. Against a constant
command that is a geometric series, so n cycles are taken in one exact step of
``1 - (1 - a)^n``; the value held over a physics step is the mean over its cycles, which gives
the linear servo the same impulse as the 1 kHz controller.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np

from shared.sim.arm import Float64
from shared.sim.parameters import CommandParameters

CYCLE: Final = 1e-3
"""Period of the controller that filters (s)."""

_POSE: Final = 7


def filter_share(coefficient: float, cycles: float) -> float:
    """Return the share of the way that ``cycles`` cycles of the filter cover."""
    return 1.0 - (1.0 - coefficient) ** cycles


def mean_share(coefficient: float, cycles: float) -> float:
    """Return the share covered at a cycle, on average over the next ``cycles`` cycles."""
    keep = 1.0 - coefficient
    return 1.0 - keep * (1.0 - keep**cycles) / (coefficient * cycles)


def blend(start: Float64, end: Float64, share: float) -> Float64:
    """Return poses on the way from ``start`` to ``end``: 0 is the start, 1 the end.

    Args:
        start: float64[..., 7], position and unit quaternion (w, x, y, z).
        end: float64[..., 7], the same; quaternions of any length.
        share: how much of the way.
    """
    if share == 1.0:
        return end.copy()
    out = np.empty_like(end)
    out[..., :3] = start[..., :3] + share * (end[..., :3] - start[..., :3])
    out[..., 3:] = _slerp(start[..., 3:], end[..., 3:], share)
    return out


def _slerp(start: Float64, end: Float64, share: float) -> Float64:
    end = end / np.linalg.norm(end, axis=-1, keepdims=True)
    cosine = np.einsum("...i,...i->...", start, end)[..., None]
    end = np.where(cosine < 0.0, -end, end)
    # atan2 of the chord's halves stays exact for small angles, where arccos does not.
    angle = 2.0 * np.arctan2(
        np.linalg.norm(end - start, axis=-1, keepdims=True),
        np.linalg.norm(end + start, axis=-1, keepdims=True),
    )
    sine = np.sin(angle)
    near = sine < 1e-9
    safe = np.where(near, 1.0, sine)
    first = np.where(near, 1.0 - share, np.sin((1.0 - share) * angle) / safe)
    second = np.where(near, share, np.sin(share * angle) / safe)
    blended = first * start + second * end
    return blended / np.linalg.norm(blended, axis=-1, keepdims=True)


@dataclass(frozen=True)
class _Piece:
    """Part of a physics step during which one command is in force."""

    command: int
    """How many control steps ago the command was given."""
    share: float
    """Of the way to the command, covered by the end of the piece."""
    mean: float
    """Of the way to the command, covered on average during the piece."""
    weight: float
    """Of the physics step."""


class CommandPath:
    """The delay and the filter of N worlds, advanced one physics step at a time."""

    def __init__(
        self,
        parameters: CommandParameters,
        num_envs: int,
        agents: int,
        control_timestep: float,
        substeps: int,
    ) -> None:
        self._pieces = _schedule(parameters, control_timestep, substeps)
        oldest = max(piece.command for step in self._pieces for piece in step)
        self._shape = (num_envs, agents, _POSE)
        self._commands = np.zeros((oldest + 1, *self._shape))
        """The last commands, newest first."""
        self._filtered = np.zeros(self._shape)

    @property
    def size(self) -> int:
        """Numbers of state per world."""
        return (len(self._commands) + 1) * self._shape[1] * _POSE

    def reset(self, ids: np.ndarray, poses: Float64) -> None:
        """Start worlds with every earlier command, and the filter, at ``poses``.

        Args:
            ids: int64[K], the worlds.
            poses: float64[K, A * 7], the agents' current tool poses.
        """
        rows = poses.reshape(len(poses), *self._shape[1:])
        self._commands[:, ids] = rows
        self._filtered[ids] = rows

    def accept(self, ctrl: Float64) -> None:
        """Take the commands of a control step: float64[N, A * 7]."""
        self._commands[1:] = self._commands[:-1]
        self._commands[0] = ctrl.reshape(self._shape)

    def advance(self, substep: int) -> Float64:
        """Return float64[N, A * 7], what the servos hold during a physics step."""
        held: Float64 | None = None
        weight = 0.0
        for piece in self._pieces[substep]:
            command = self._commands[piece.command]
            mean = blend(self._filtered, command, piece.mean)
            self._filtered = blend(self._filtered, command, piece.share)
            weight += piece.weight
            held = mean if held is None else blend(held, mean, piece.weight / weight)
        assert held is not None
        return held.reshape(self._shape[0], -1)

    def state(self) -> Float64:
        """Return float64[N, size]."""
        rows = [*self._commands, self._filtered]
        return np.concatenate([row.reshape(self._shape[0], -1) for row in rows], axis=1)

    def restore(self, state: Float64) -> None:
        """Continue from what :meth:`state` returned."""
        rows = state.reshape(self._shape[0], len(self._commands) + 1, *self._shape[1:])
        self._commands[:] = np.moveaxis(rows[:, :-1], 1, 0)
        self._filtered = rows[:, -1].copy()


def _schedule(
    parameters: CommandParameters, control_timestep: float, substeps: int
) -> list[list[_Piece]]:
    """Return, for each physics step of a control step, which commands are in force."""
    physics = control_timestep / substeps
    whole, rest = divmod(parameters.delay, control_timestep)
    if control_timestep - rest < 1e-9:  # 0.03 / 0.01 leaves a rest of nearly a whole step
        whole, rest = whole + 1, 0.0
    schedule: list[list[_Piece]] = []
    for substep in range(substeps):
        begin, end = substep * physics, (substep + 1) * physics
        change = min(max(rest, begin), end)
        spans = [(int(whole) + 1, change - begin), (int(whole), end - change)]
        schedule.append(
            [
                _Piece(
                    command=command,
                    share=filter_share(parameters.filter, span / CYCLE),
                    mean=mean_share(parameters.filter, span / CYCLE),
                    weight=span / physics,
                )
                for command, span in spans
                if span > 1e-9
            ]
        )
    return schedule
