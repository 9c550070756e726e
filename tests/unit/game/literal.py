"""The game written down slowly: one bout, one step, plain Python; what the fast code must equal."""

import math
from collections.abc import Iterable

Vector = tuple[float, float, float]


def rotated_x(quaternion: tuple[float, float, float, float]) -> Vector:
    """The x axis of a frame, as the first column of the textbook rotation matrix."""
    w, x, y, z = quaternion
    return (w * w + x * x - y * y - z * z, 2 * (x * y + w * z), 2 * (x * z - w * y))


def end_points(grip: Vector, direction: Vector, back: float, front: float) -> tuple[Vector, Vector]:
    """The two ends of a blade."""
    first, last = (
        tuple(g + along * d for g, d in zip(grip, direction, strict=True))
        for along in (back, front)
    )
    return first, last  # type: ignore[return-value]


def minus(a: Vector, b: Vector) -> Vector:
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def times(a: Vector, b: Vector) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def point_to_segment(point: Vector, first: Vector, last: Vector) -> float:
    """The distance of a point from a segment, by looking at the ends and at the foot."""
    along = minus(last, first)
    candidates = [math.dist(point, first), math.dist(point, last)]
    share = times(minus(point, first), along) / times(along, along)
    if 0.0 < share < 1.0:
        foot = tuple(f + share * a for f, a in zip(first, along, strict=True))
        candidates.append(math.dist(point, foot))
    return min(candidates)


def segment_to_segment(a: tuple[Vector, Vector], b: tuple[Vector, Vector]) -> float:
    """The distance of two segments: the best of the four ends, and of the inner crossing."""
    candidates = [point_to_segment(end, *b) for end in a] + [point_to_segment(e, *a) for e in b]
    u, v, w = minus(a[1], a[0]), minus(b[1], b[0]), minus(a[0], b[0])
    uu, uv, vv, uw, vw = times(u, u), times(u, v), times(v, v), times(u, w), times(v, w)
    determinant = uu * vv - uv * uv
    if determinant > 1e-14:
        s, t = (uv * vw - vv * uw) / determinant, (uu * vw - uv * uw) / determinant
        if 0.0 <= s <= 1.0 and 0.0 <= t <= 1.0:
            gap = tuple(wi + s * ui - t * vi for wi, ui, vi in zip(w, u, v, strict=True))
            candidates.append(math.hypot(*gap))
    return min(candidates)


def paper_points(
    steps: Iterable[tuple[bool, bool, bool]], free_steps: int, *, once: bool = False
) -> list[float]:
    """The paper's algorithm "The Fencing Game Scoring Mechanism", line by line.

    Args:
        steps: of one bout: bat_a in target, bat_a contacts bat_p, bat_p in target.
        free_steps: 200 in the paper.
        once: the prose instead of the algorithm: pay once for every ``free_steps`` waited.
    """
    points: list[float] = []
    consecutive = 0
    unpaid = 0
    for a_in_target, contacts, p_in_target in steps:
        s = 0.0
        if a_in_target:
            if contacts:
                s -= 10
            else:
                s += 1
        if p_in_target:
            consecutive += 1
            unpaid += 1
        else:
            consecutive = unpaid = 0
        if once:
            if unpaid > free_steps:
                s += 10
                unpaid -= free_steps
        elif consecutive > free_steps:
            s += 10
        points.append(s)
    return points
