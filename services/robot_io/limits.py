"""Where a tool may go and how fast: one step of a command towards its goal, always stoppable.

A command is only taken if braking straight from it, at the allowed deceleration, stays inside
everything that is allowed; where moving and turning together would not, it does one of the two, or
else brakes, along the way that was checked before.
So by induction no goal whatsoever leads out of the box, over a speed or over an acceleration.
"""

import math
from typing import NamedTuple

from services.robot_io.config import SafetyConfig
from services.robot_io.poses import (
    ZERO,
    Pose,
    Vector,
    add,
    distance,
    length,
    rotated,
    rotation_between,
    scale,
    shortened,
    turned,
)

ROUNDING = 1e-9
"""How far rounding may carry a command over a limit (m, rad, m/s)."""


class Blade(NamedTuple):
    """The bat in the tool frame: a capsule on a line through the tool's origin."""

    direction: Vector
    """Of the axis, unit length."""
    front: float
    """Where the axis ends, from the tool (m)."""
    back: float
    """Where it begins; negative behind the tool (m)."""
    radius: float
    """m."""


class Motion(NamedTuple):
    """A command and how it moves."""

    pose: Pose
    velocity: Vector
    """m/s."""
    spin: Vector
    """rad/s."""

    @staticmethod
    def at_rest(pose: Pose) -> "Motion":
        """Return a command that stands still."""
        return Motion(pose, ZERO, ZERO)

    @property
    def is_still(self) -> bool:
        """Return whether it does not move at all."""
        return self.velocity == ZERO and self.spin == ZERO


class Space:
    """Where tool and bat may be: the box, below the ceiling, away from the person."""

    def __init__(self, cfg: SafetyConfig, blade: Blade) -> None:
        self._cfg = cfg
        self._blade = blade
        self._reach = max(blade.front, -blade.back)

    def clearance(self, pose: Pose) -> float:
        """Return how far the pose may move before it can meet a limit (m); negative outside."""
        cfg, (x, y, z) = self._cfg, pose.position
        low, high = cfg.box_low, cfg.box_high
        box = min(
            x - low[0], high[0] - x, y - low[1], high[1] - y, z - low[2], high[2] - z
        )  # fmt: skip
        return min(box, *self._bat_clearances(pose))

    def allows(self, pose: Pose) -> bool:
        """Return whether the robot may be commanded there."""
        return self.clearance(pose) >= -ROUNDING

    def nearest(self, pose: Pose) -> Pose:
        """Return the pose moved into what is allowed; where that fails, at least into the box."""
        position = self._into_box(pose.position)
        over, inside = self._bat_clearances(Pose(position, pose.orientation))
        if over < 0.0:
            position = add(position, (0.0, 0.0, over))
        if inside < 0.0:
            x, y = self._cfg.keep_out
            away = shortened((position[0] - x, position[1] - y, 0.0), 1.0)
            position = add(position, away, -inside)
        return Pose(self._into_box(position), pose.orientation)

    @property
    def reach(self) -> float:
        """Return the furthest point of the bat from the tool (m)."""
        return self._reach

    def _into_box(self, position: Vector) -> Vector:
        low, high = self._cfg.box_low, self._cfg.box_high
        return (
            min(max(position[0], low[0]), high[0]),
            min(max(position[1], low[1]), high[1]),
            min(max(position[2], low[2]), high[2]),
        )

    def _bat_clearances(self, pose: Pose) -> tuple[float, float]:
        """Return how far the bat is below the ceiling and outside the person's cylinder (m)."""
        blade, cfg = self._blade, self._cfg
        along = rotated(pose.orientation, blade.direction)
        front = add(pose.position, along, blade.front)
        back = add(pose.position, along, blade.back)
        below = cfg.ceiling - max(front[2], back[2]) - blade.radius
        # The nearest point of the blade to the cylinder's axis, seen from above.
        ax, ay = cfg.keep_out
        dx, dy = front[0] - back[0], front[1] - back[1]
        square = dx * dx + dy * dy
        share = 0.0
        if square > 1e-12:
            share = min(max(((ax - back[0]) * dx + (ay - back[1]) * dy) / square, 0.0), 1.0)
        gap = math.hypot(back[0] + share * dx - ax, back[1] + share * dy - ay)
        return below, gap - cfg.keep_out_radius - blade.radius


def advance(
    motion: Motion, goal: Pose | None, measured: Pose, speed: float, space: Space,
    cfg: SafetyConfig, period: float,
) -> Motion:  # fmt: skip
    """Return the command one period later.

    Args:
        motion: the last command.
        goal: where it should go; None brakes.
        measured: where the tool is.
        speed: most that is allowed now (m/s); turns are slowed in proportion.
        space: where the command may go.
        cfg: the limits.
        period: from command to command (s).
    """
    braking = _braked(motion, cfg, period)
    if goal is None:
        return braking
    goal = space.nearest(goal)
    turn_speed = cfg.turn_speed * min(speed / cfg.game_speed, 1.0)
    way = add(goal.position, motion.pose.position, -1.0)
    velocity = _towards(motion.velocity, way, speed, cfg.acceleration, period)
    turn = rotation_between(motion.pose.orientation, goal.orientation)
    spin = _towards(motion.spin, turn, turn_speed, cfg.turn_acceleration, period)
    # At a limit, moving and turning together may lead over it where one of the two does not.
    for way_there in ((velocity, spin), (velocity, braking.spin), (braking.velocity, spin)):
        tried = _moved(motion, *way_there, period)
        if _is_safe(tried, braking, measured, space, cfg, period):
            return tried
    return braking


def _towards(now: Vector, way: Vector, speed: float, acceleration: float, period: float) -> Vector:
    """Return the velocity of the next period: fast, and slow enough to stop at the goal."""
    far = length(way)
    wanted = ZERO
    step = acceleration * period
    if far > 0.0:
        # n periods of even braking cover n (n + 1) / 2 steps of velocity.
        stoppable = 0.5 * step * (math.sqrt(1.0 + 8.0 * far / (step * period)) - 1.0)
        wanted = scale(way, min(speed, stoppable, far / period) / far)
    return add(now, shortened(add(wanted, now, -1.0), step))


def _braked(motion: Motion, cfg: SafetyConfig, period: float) -> Motion:
    """Return the command after one period of braking along its way."""
    if motion.is_still:
        return motion
    velocity = _slower(motion.velocity, cfg.acceleration * period)
    spin = _slower(motion.spin, cfg.turn_acceleration * period)
    return _moved(motion, velocity, spin, period)


def _slower(velocity: Vector, step: float) -> Vector:
    size = length(velocity)
    return ZERO if size <= step * (1.0 + 1e-9) else scale(velocity, 1.0 - step / size)


def _moved(motion: Motion, velocity: Vector, spin: Vector, period: float) -> Motion:
    pose = Pose(
        add(motion.pose.position, velocity, period),
        turned(motion.pose.orientation, scale(spin, period)),
    )
    return Motion(pose, velocity, spin)


def _is_safe(
    tried: Motion, braking: Motion, measured: Pose, space: Space, cfg: SafetyConfig, period: float
) -> bool:
    """Return whether braking from ``tried`` stays in the space and close to the tool.

    When the tool itself has been carried off, a command that comes back to it is always safe.
    """
    stop = _stop(tried, cfg, period)
    if not _is_near(stop, braking, measured, cfg, period):
        return False
    way = distance(tried.pose.position, stop.position)
    turn = length(rotation_between(tried.pose.orientation, stop.orientation))
    if space.clearance(tried.pose) >= way + turn * space.reach:
        return True
    while not tried.is_still:
        if not space.allows(tried.pose):
            return False
        tried = _braked(tried, cfg, period)
    return space.allows(tried.pose)


def _is_near(stop: Pose, braking: Motion, measured: Pose, cfg: SafetyConfig, period: float) -> bool:
    """Return whether a stop is within the lead, or no further off than braking now would be."""
    lead, turn = _lead(stop, measured)
    if lead <= cfg.lead and turn <= cfg.turn_lead:
        return True
    other_lead, other_turn = _lead(_stop(braking, cfg, period), measured)
    return lead <= max(cfg.lead, other_lead) and turn <= max(cfg.turn_lead, other_turn)


def _lead(pose: Pose, measured: Pose) -> tuple[float, float]:
    """Return how far a pose is from the tool (m, rad)."""
    turn = rotation_between(measured.orientation, pose.orientation)
    return distance(pose.position, measured.position), length(turn)


def _stop(motion: Motion, cfg: SafetyConfig, period: float) -> Pose:
    """Return where braking from a command ends."""
    way = _braking_way(motion.velocity, cfg.acceleration, period)
    turn = _braking_way(motion.spin, cfg.turn_acceleration, period)
    return Pose(add(motion.pose.position, way), turned(motion.pose.orientation, turn))


def _braking_way(velocity: Vector, acceleration: float, period: float) -> Vector:
    """Return the way that is covered while the velocity shrinks by one step a period."""
    size = length(velocity)
    step = acceleration * period
    if size <= step:
        return ZERO
    periods = math.ceil(size / step - 1e-9) - 1
    covered = period * (periods * size - 0.5 * step * periods * (periods + 1))
    return scale(velocity, covered / size)
