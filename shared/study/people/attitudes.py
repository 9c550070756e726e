"""What simulated participants answer: drawn from latent attitudes that are invented.

The answers fill a questionnaire so that its pages, its tables and its analysis can be rehearsed.
They say nothing about what people think of a robot, and are never a finding.
"""

import math
from collections.abc import Sequence
from typing import Final

import numpy as np

from shared.study.people.population import Traits
from shared.study.protocol import Item

SIMULATED_TEXT: Final = "(simulated answer)"
AGREEMENT: Final = 0.7
"""Mean of the latent agreement: people who come to such a study tend to agree (invented)."""
_DIFFICULTY: Final = ("difficult", "challeng", "hard", "demanding")
"""Words of a question that asks how hard it was."""


def points(item: Item, traits: Traits, success: float, rng: np.random.Generator) -> int:
    """Return an answer on a scale of points.

    Args:
        item: whose scale is a number of points.
        traits: who answers.
        success: how well the games went that it is about, standardised.
        rng: draws what this one answer has of its own.
    """
    assert isinstance(item.scale, int)
    attitude = AGREEMENT + 0.5 * traits.enthusiasm + 0.2 * success
    latent = -attitude if item.is_reversed else attitude
    latent += 0.2 * traits.acquiescence + 0.7 * rng.standard_normal()
    half = 0.5 * (item.scale - 1)
    return int(np.clip(round(1.0 + half + 0.5 * half * latent), 1, item.scale))


def choices(item: Item, rng: np.random.Generator) -> tuple[str, ...]:
    """Return the options that are chosen: one, or each with some chance where several may be."""
    options = [option for option in item.options if option != item.other]
    if not item.is_several:
        return (options[int(rng.integers(len(options)))],)
    chosen = tuple(option for option in options if rng.random() < 0.3)
    return chosen or (options[int(rng.integers(len(options)))],)


def words(item: Item, traits: Traits) -> str:
    """Return an answer in one's own words: the age where that is asked for, else nothing real."""
    return f"{traits.age:.0f}" if item.construct.lower() == "age" else SIMULATED_TEXT


def ranks(item: Item, scores: Sequence[float], rng: np.random.Generator) -> tuple[int, ...]:
    """Return a place for each finished section, 1 the least; equal places are ties.

    Args:
        item: which ranks.
        scores: mean score of each section, in their order.
        rng: draws what is not the score's.
    """
    text = item.text.lower()
    sign = -1.0 if any(word in text for word in _DIFFICULTY) else 0.3
    spread = float(np.std(scores)) or 1.0
    felt = [
        round(sign * (score - float(np.mean(scores))) / spread + 0.8 * rng.standard_normal())
        for score in scores
    ]  # rounded: what feels alike is ranked alike
    places = sorted(set(felt))
    return tuple(places.index(value) + 1 for value in felt)


def standardised(score: float, scores: Sequence[float]) -> float:
    """Return how a score stands among others of the same person, in [-2, 2]."""
    if len(scores) < 2 or not (spread := float(np.std(scores))) or not math.isfinite(score):
        return 0.0
    return float(np.clip((score - float(np.mean(scores))) / spread, -2.0, 2.0))
