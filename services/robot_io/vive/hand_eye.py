# pyright: basic
"""Where the base stations stand to the robot, from poses of a tracker on its gripper.

With the tracker taped to the gripper, every pose i obeys Z V_i X = G_i: Z the base stations' frame
in the torso frame, V_i the tracker in the base stations' frame, X the tool in the tracker's frame,
G_i the tool in the torso frame (robot-world / hand-eye calibration, Zhuang 1994). Z and X are
found together; a mounting that is ignored costs its length in accuracy.
"""

from typing import Final

import msgspec
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from shared.errors import RobotFault

Floats = NDArray[np.float64]

LEVER: Final = 0.5
"""A turn counts as this much of a shift (m): tracker and robot are about as good in both."""
SCALE: Final = 0.003
"""Residuals beyond this lose weight (m)."""
REJECT_M: Final = 0.010
REJECT_RAD: Final = 0.05
"""A pose that misses by more does not belong to the others."""
MAX_REJECTED: Final = 1 / 3
LEAST_POSES: Final = 15
LEAST_SPREAD: Final = np.deg2rad(8.0)
"""Turns smaller than this (RMS, about the second axis) leave the mounting undecided."""
MOST_M: Final = 0.008
"""Largest error that is accepted, on poses held out and as expected within a metre."""
FOLDS: Final = 5
STARTS: Final = 30
STARTING_POSES: Final = 6
NEAR_M: Final = 1.0


class Refused(RobotFault):
    """The poses do not give a calibration that is good enough; says why."""


class HandEye(msgspec.Struct, frozen=True, kw_only=True):
    """A calibration that is good enough."""

    torso_from_base: Floats
    """float64[7]: position (m), orientation (w x y z)."""
    tracker_from_tool: Floats
    """float64[7]."""
    used: NDArray[np.bool_]
    """bool[N]: the poses that count."""
    residual: float
    """Root mean square over these (m)."""
    held_out: float
    """The same, each pose judged by a fit without it (m)."""
    expected: float
    """Expected error of a point within a metre of the torso frame (m, RMS)."""
    spread: float
    """See ``spread_of`` (rad)."""


def solve(tracker: Floats, tool: Floats, rng: np.random.Generator) -> HandEye:
    """Return the calibration of N pairs of poses.

    Args:
        tracker: float64[N, 7] in the base stations' frame: position (m), orientation (w x y z).
        tool: float64[N, 7] in the torso frame.
        rng: draws the subsets that the search starts from, and those that are held out.

    Raises:
        Refused: there are too few poses, they are too much alike, they do not fit each other, or
            the result is not accurate enough.
        ValueError: the arrays have other shapes, or are not finite.
    """
    if tracker.shape != tool.shape or tracker.ndim != 2 or tracker.shape[1] != 7:
        raise ValueError(f"poses are {tracker.shape} and {tool.shape}, expected twice [N, 7]")
    if not (np.isfinite(tracker).all() and np.isfinite(tool).all()):
        raise ValueError("a pose is not finite")
    if len(tool) < LEAST_POSES:
        raise Refused(f"{len(tool)} poses, at least {LEAST_POSES} are needed")
    check_spread(tracker)
    pairs = _Pairs(tracker, tool)
    guess = _start(pairs, rng)
    used = np.ones(len(tool), bool)
    for _ in range(5):
        guess = _fit(pairs.of(used), guess)
        shifts, turns = pairs.misses(guess)
        fits = (shifts <= REJECT_M) & (turns <= REJECT_RAD)
        if fits.sum() < max(LEAST_POSES, (1.0 - MAX_REJECTED) * len(fits)):
            raise Refused(
                f"{(~fits).sum()} of {len(fits)} poses miss by more than {1e3 * REJECT_M:.0f} mm: "
                "is the tracker fixed to the gripper, is anything reflecting, does a base "
                "station shake?"
            )
        if (fits == used).all():
            break
        used = fits
    inliers = pairs.of(used)
    check_spread(tracker[used])
    residual = _rms(inliers.misses(guess)[0])
    held_out = _held_out(inliers, guess, rng)
    if held_out > MOST_M:
        raise Refused(
            f"poses held out miss by {1e3 * held_out:.1f} mm (RMS), limit {1e3 * MOST_M:.0f}: "
            "hold the arm stiller, look for reflections, fix the base stations"
        )
    expected = _expected(inliers, guess)
    if expected > MOST_M:
        raise Refused(
            f"a bat would be off by {1e3 * expected:.1f} mm (RMS) within {NEAR_M:g} m, limit "
            f"{1e3 * MOST_M:.0f}: take more poses, turned further and further apart"
        )
    return HandEye(
        torso_from_base=_seven(guess[:6]),
        tracker_from_tool=_seven(guess[6:]),
        used=used,
        residual=residual,
        held_out=held_out,
        expected=expected,
        spread=spread_of(tracker[used]),
    )


def spread_of(poses: Floats) -> float:
    """Return how far poses are turned about all but one axis (rad, RMS about the second axis).

    Turns about one axis only, however far, leave the place along that axis undecided.
    """
    if len(poses) < 2:
        return 0.0
    turns = Rotation.from_quat(poses[:, 3:], scalar_first=True)
    vectors = (turns * turns.mean().inv()).as_rotvec()
    return float(np.linalg.svd(vectors, compute_uv=False)[1] / np.sqrt(len(poses)))


def check_spread(poses: Floats) -> None:
    """Check that poses are turned far enough.

    Raises:
        Refused: they are not.
    """
    if (spread := spread_of(poses)) < LEAST_SPREAD:
        raise Refused(
            f"the gripper was turned by {np.rad2deg(spread):.1f} degrees (RMS about its second "
            f"axis), at least {np.rad2deg(LEAST_SPREAD):.0f} are needed: turn it by 35 degrees "
            "either way about every axis"
        )


class _Pairs:
    """Poses of tracker and tool, as rotations and places."""

    def __init__(self, tracker: Floats, tool: Floats) -> None:
        self.tracker, self.tool = tracker, tool
        self.turned = Rotation.from_quat(tracker[:, 3:], scalar_first=True)
        self.wanted = Rotation.from_quat(tool[:, 3:], scalar_first=True)

    def of(self, which: NDArray) -> "_Pairs":
        return _Pairs(self.tracker[which], self.tool[which])

    def residuals(self, guess: Floats) -> Floats:
        """Return float64[N, 6]: shift (m), and turn times ``LEVER``."""
        stations, mount = Rotation.from_rotvec(guess[:3]), Rotation.from_rotvec(guess[6:9])
        places = self.turned.apply(guess[9:12]) + self.tracker[:, :3]
        shift = stations.apply(places) + guess[3:6] - self.tool[:, :3]
        turn = (stations * self.turned * mount * self.wanted.inv()).as_rotvec()
        return np.hstack([shift, LEVER * turn])

    def misses(self, guess: Floats) -> tuple[Floats, Floats]:
        """Return float64[N] shifts (m) and turns (rad)."""
        found = self.residuals(guess)
        return np.linalg.norm(found[:, :3], axis=1), np.linalg.norm(found[:, 3:], axis=1) / LEVER


def _start(pairs: _Pairs, rng: np.random.Generator) -> Floats:
    """Return the best of linear solutions from a few poses each, by the median of the misses."""
    best, least = np.zeros(12), np.inf
    for _ in range(STARTS):
        chosen = rng.permutation(len(pairs.tool))[:STARTING_POSES]
        guess = _linear(pairs.of(chosen))
        median = float(np.median(np.linalg.norm(pairs.residuals(guess), axis=1)))
        if median < least:
            best, least = guess, median
    return best


def _linear(pairs: _Pairs) -> Floats:
    """Return the solution of the linear equations: first the rotations, then the places."""
    turned, wanted = pairs.turned.as_matrix(), pairs.wanted.as_matrix()
    eye = np.eye(3)
    # R_Z R_V = R_G R_X^T, for the entries of R_Z and R_X^T, each row by row
    rows = [
        np.hstack([np.kron(eye, v.T), -np.kron(g, eye)])
        for v, g in zip(turned, wanted, strict=True)
    ]
    found = np.linalg.svd(np.vstack(rows))[2][-1].reshape(2, 3, 3)
    found *= np.sign(np.linalg.det(found[0])) or 1.0
    stations, mount_back = (_nearest_rotation(matrix) for matrix in found)
    # R_Z R_V t_X + t_Z = t_G - R_Z t_V
    matrix = np.vstack([np.hstack([stations @ v, eye]) for v in turned])
    right = (pairs.tool[:, :3] - pairs.tracker[:, :3] @ stations.T).ravel()
    places = np.linalg.lstsq(matrix, right, rcond=None)[0]
    guess = np.zeros(12)
    guess[:3], guess[3:6] = Rotation.from_matrix(stations).as_rotvec(), places[3:]
    guess[6:9], guess[9:] = Rotation.from_matrix(mount_back.T).as_rotvec(), places[:3]
    return guess


def _nearest_rotation(matrix: Floats) -> Floats:
    left, _, right = np.linalg.svd(matrix)
    return left @ np.diag([1.0, 1.0, np.linalg.det(left @ right)]) @ right


def _fit(pairs: _Pairs, guess: Floats) -> Floats:
    """Return the robust least-squares solution near a guess."""
    return least_squares(
        lambda values: pairs.residuals(values).ravel(), guess, loss="soft_l1", f_scale=SCALE
    ).x


def _held_out(pairs: _Pairs, guess: Floats, rng: np.random.Generator) -> float:
    """Return how far poses miss that the fit has not seen (m, RMS): each is held out once."""
    order = rng.permutation(len(pairs.tool))
    misses = []
    for fold in range(FOLDS):
        held = order[fold::FOLDS]
        others = np.setdiff1d(order, held)
        misses.append(pairs.of(held).misses(_fit(pairs.of(others), guess))[0])
    return _rms(np.concatenate(misses))


def _expected(pairs: _Pairs, guess: Floats) -> float:
    """Return the RMS error, over the corners of a cube, that the residuals let expect (m)."""
    solution = least_squares(lambda values: pairs.residuals(values).ravel(), guess)
    freedom = solution.fun.size - solution.x.size
    variance = 2.0 * solution.cost / freedom
    spread = np.linalg.pinv(solution.jac.T @ solution.jac) * variance
    corners = NEAR_M * np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, -1).T

    def seen(values: Floats) -> Floats:
        """Return the corners, fixed to the base stations, where these values put them."""
        return Rotation.from_rotvec(values[:3]).apply(stations) + values[3:6]

    x = solution.x
    stations = Rotation.from_rotvec(x[:3]).inv().apply(corners - x[3:6])
    step = 1e-6
    changes = np.array([(seen(x + step * row) - seen(x)) / step for row in np.eye(12)[:6]])
    total = np.einsum("aij,ab,bij->i", changes, spread[:6, :6], changes)
    return float(np.sqrt(np.mean(total)))


def _rms(values: Floats) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def _seven(guess: Floats) -> Floats:
    """Return position and quaternion of a rotation vector and a position."""
    turn = Rotation.from_rotvec(guess[:3]).as_quat(scalar_first=True, canonical=True)
    return np.concatenate([guess[3:6], turn])
