"""The eight end-effector features of a bout (paper, "Styles and selection"), summed up online.

The paper names the features and gives no formulas; these are ours. The end effector is the bat's
frame at the grip, in the world's frame: x along the line between the robots, z up. With positions
p_k and velocities v_k after control steps k = 1..n, one every dt:

- acceleration a_k = (v_k - v_{k-1}) / dt and jerk j_k = (a_k - a_{k-1}) / dt, as vectors;
- displacement change of an axis: sum of abs(x_k - x_{k-1}), the way travelled along it;
- mean velocity, acceleration, jerk: mean magnitude of the n, n - 1, n - 2 vectors there are;
- kinetic energy: the time integral of m |v|^2 / 2 over the bout, which does not depend on dt, with
  the mass of gripper and bat; translation only, as the paper's feature is of a trajectory;
- smoothness: log dimensionless jerk, -ln(D^3 / v^2 * integral of |j|^2 dt), D the duration and v
  the mean speed (Hogan & Sternad 2009, J. Motor Behavior 41(6), eq. 4-6: with the path's length as
  amplitude A, D^5 / A^2 is D^3 / v^2). A minimum-jerk reach has -ln 720 = -6.6; less is rougher. It
  ends at 0, which straight uniform motion and (by convention) a hand that holds still have.

Imports numpy only: it runs inside the actor's loop.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Float32s = NDArray[np.float32]


class Feature(NamedTuple):
    """One of the eight numbers that describe how a side moved in a bout."""

    name: str
    """As in files and code."""
    title: str
    """As in tables and figures."""
    unit: str
    definition: str


FEATURES = (
    Feature("displacement_x", "displacement x", "m", "way travelled along x, sum of |dx|"),
    Feature("displacement_y", "displacement y", "m", "way travelled along y, sum of |dy|"),
    Feature("displacement_z", "displacement z", "m", "way travelled along z, sum of |dz|"),
    Feature("mean_velocity", "velocity", "m/s", "mean speed"),
    Feature("mean_acceleration", "acceleration", "m/s^2", "mean magnitude of the acceleration"),
    Feature("mean_jerk", "jerk", "m/s^3", "mean magnitude of the jerk"),
    Feature(
        "kinetic_energy", "kinetic energy", "J s", "time integral of m v^2 / 2 of hand and bat"
    ),
    Feature("smoothness", "smoothness", "1", "log dimensionless jerk, -ln(D^3 / v^2 * int j^2 dt)"),
)

MOVING_MASS = 1.16360
"""What moves with the end effector (kg): palm, fingers and finger tips of the PR2's gripper
(1.01360, shared/sim/data/pr2_arm.toml) and the nominal bat (0.15, shared/sim/data/nominal.toml)."""
STILL_M_S = 1e-4
"""Mean speed below which a hand counts as still (m/s): 2 mm of way in a bout."""


class StyleMeter:
    """Sums up the features of N bouts that started together, both sides, step by step."""

    def __init__(self, num_envs: int, timestep: float) -> None:
        """Begin.

        Args:
            num_envs: N.
            timestep: control period (s).

        Raises:
            ValueError: one of them is not above zero.
        """
        if num_envs < 1 or not timestep > 0.0:
            raise ValueError(f"num_envs ({num_envs}) and timestep ({timestep} s) must be positive")
        self._timestep = timestep
        shape = (3, 2, num_envs)
        self._steps = 0
        self._position: Floats = np.zeros(shape)
        self._moved: Floats = np.empty(shape)
        self._way: Floats = np.zeros(shape)
        # Velocity, its difference, and the difference's: of the newest step and the one before.
        self._newest: Floats = np.zeros((3, *shape))
        self._before: Floats = np.zeros((3, *shape))
        self._products: Floats = np.empty((3, *shape))
        self._squares: Floats = np.empty(shape)
        self._sum_of_squares: Floats = np.zeros(shape)
        self._sum_of_lengths: Floats = np.zeros(shape)

    def add(self, positions: Floats, velocities: Floats) -> None:
        """Take in the state after one control step.

        Args:
            positions: float64[3, 2, N], of the bat frames in the world (m), antagonist first.
            velocities: float64[3, 2, N], linear (m/s).
        """
        if self._steps:
            np.subtract(positions, self._position, out=self._moved)
            np.abs(self._moved, out=self._moved)
            self._way += self._moved
        self._position[:] = positions
        before, newest = self._newest, self._before
        self._newest, self._before = newest, before
        newest[0] = velocities
        np.subtract(newest[0], before[0], out=newest[1])
        np.subtract(newest[1], before[1], out=newest[2])
        if self._steps < 2:
            newest[self._steps + 1 :] = 0.0  # no acceleration yet, or no jerk
        np.multiply(newest, newest, out=self._products)
        np.add.reduce(self._products, axis=1, out=self._squares)
        self._sum_of_squares += self._squares
        np.sqrt(self._squares, out=self._squares)
        self._sum_of_lengths += self._squares
        self._steps += 1

    def features(self) -> Float32s:
        """Return float32[N, 2, 8], the features of what was added so far, in FEATURES' order.

        Raises:
            ValueError: fewer than three steps were added, so that there is no jerk.
        """
        if self._steps < 3:
            raise ValueError(f"a bout of {self._steps} steps has no jerk; it needs at least 3")
        steps, dt = self._steps, self._timestep
        speed = self._sum_of_lengths[0] / steps
        squared_jerk = self._sum_of_squares[2] / dt**3  # integral of |j|^2 dt
        duration = (steps - 1) * dt
        still = speed < STILL_M_S
        roughness = duration**3 * squared_jerk / np.where(still, 1.0, speed) ** 2
        roughness[still] = 1.0
        columns = [
            *self._way,
            speed,
            self._sum_of_lengths[1] / ((steps - 1) * dt),
            self._sum_of_lengths[2] / ((steps - 2) * dt**2),
            0.5 * MOVING_MASS * dt * self._sum_of_squares[0],
            -np.log(np.maximum(roughness, 1.0)),
        ]
        return np.ascontiguousarray(np.stack(columns).T, np.float32)

    def reset(self) -> None:
        """Forget everything: the next step begins new bouts."""
        self._steps = 0
        for sums in (self._way, self._sum_of_squares, self._sum_of_lengths):
            sums.fill(0.0)
