"""What the page is told: frames at the pace of the bat states, and notes when something changes."""

from typing import Any

import msgspec
import numpy as np

from services.page.config import PERSON, PageConfig
from services.page.course import Course
from services.page.hearing import Hearing
from shared.messages.message import Array

_ENCODER = msgspec.json.Encoder()
POSE = 7
DIGITS = 5
"""Places after the point: 10 um, for the eye."""
SHOWN_RATES = ("real_time_factor", "lateness_p99_ms", "command_p50_ms")


def frame(
    heard: Hearing, course: Course, echo: int, *, is_lost: bool, now: float
) -> bytes:  # fmt: skip
    """Return everything that moves, as one JSON object.

    Args:
        heard: what the bus said last.
        course: of play.
        echo: the page's own sequence number in the newest bat states, -1 for none.
        is_lost: whether no page says where the mouse is.
        now: by the service's clock (s).
    """
    said: dict[str, Any] = {
        "type": "frame",
        "echo": echo,
        "is_lost": is_lost,
        "missing": heard.missing(now),
        "step": course.step,
        "left": round(course.left(now), 2),
        "heart_rate": heard.heart_rate(now),
    }
    rates = heard.rates(now)
    said["rates"] = {name: round(rates[name], 3) for name in SHOWN_RATES if name in rates}
    if (bats := heard.bats) is not None:
        said["tick"] = bats.tick
        said["bats"] = _round(bats.bats[:, :POSE])
        said["is_valid"] = bats.is_valid.tolist()
    if (arms := heard.arms) is not None:
        said["joints"] = _round(arms.positions)
        said["is_there"] = arms.is_there.tolist()
    if (gate := heard.gate) is not None:
        said["gate"] = {"mode": gate.mode, "reason": gate.reason, "is_clipped": gate.is_clipped}
    if (state := heard.referee) is not None:
        said["referee"] = {
            "bout": state.bout,
            "phase": state.phase,
            "reason": state.reason,
            "antagonist": state.antagonist,
            "protagonist": "" if course.is_led else state.protagonist,
            "seconds": round(state.seconds, 3),
            "score": state.score,
            "points": state.points,
            "in_target": state.in_target.tolist(),
            "contact": state.contact,
            "attack_steps": state.attack_steps,
            "penalty_steps": state.penalty_steps,
            "camping_steps": state.camping_steps,
            "tone_hz": state.tone_hz,
        }
    return _ENCODER.encode(said)


def hello(cfg: PageConfig, course: Course, bout_seconds: float, rules: dict[str, float]) -> bytes:
    """Return what a new page has to know once.

    Args:
        cfg: settings of the page.
        course: of play.
        bout_seconds: length of a bout (s).
        rules: points by name.
    """
    return _ENCODER.encode({
        "type": "hello",
        "pointer": cfg.pointer,
        "is_person": cfg.antagonist == PERSON,
        "antagonist": cfg.antagonist,
        "is_led": cfg.is_led,
        "players": [] if cfg.is_led else [name for name, _ in cfg.players],
        "chosen": "" if cfg.is_led else course.chosen,
        "bout_seconds": bout_seconds,
        "rules": rules,
    })  # fmt: skip


def results(course: Course) -> bytes:
    """Return the bouts fenced so far, and who is next; nothing where a study leads."""
    fenced, chosen = ([], "") if course.is_led else (course.results, course.chosen)
    return _ENCODER.encode({"type": "results", "results": fenced, "chosen": chosen})


def note(about: str, is_done: bool, lines: list[str]) -> bytes:
    """Return what came of a wish: about what, whether it was done, why not."""
    return _ENCODER.encode({"type": "note", "about": about, "is_done": is_done, "lines": lines})


def _round(numbers: Array) -> Any:
    return np.round(numbers, DIGITS).tolist()
