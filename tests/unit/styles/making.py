"""Made-up tournaments for tests."""

import numpy as np

from shared.game.rules import RuleBook
from shared.styles.bouts import BoutTable, Provenance
from shared.styles.features import FEATURES

RULES = RuleBook()


def reference(side: str, number: int) -> str:
    """Return a reference as a snapshot has one."""
    return "sha256:" + f"{side}{number:x}".ljust(64, "0")


def table(
    antagonists: int = 2, protagonists: int = 3, bouts: int = 4, *, seed: int = 0
) -> BoutTable:
    """Return a whole tournament in which points, penalties and camping happen."""
    generator = np.random.default_rng(seed)
    count = antagonists * protagonists * bouts
    one, two, number = np.indices((antagonists, protagonists, bouts), np.int32).reshape(3, -1)
    attack = generator.integers(0, 900, count, np.int32)
    penalty = generator.integers(0, 60, count, np.int32)
    camping = generator.integers(0, 20, count, np.int32)
    score = RULES.point * attack + RULES.penalty * penalty + RULES.camping_award * camping
    pools = [
        tuple(reference(side, k) for k in range(size))
        for side, size in (("a", antagonists), ("b", protagonists))
    ]
    return BoutTable(
        antagonists=pools[0],
        protagonists=pools[1],
        antagonist=one.copy(),
        protagonist=two.copy(),
        bout=number.copy(),
        seed=generator.integers(0, 2**62, count),
        score=score.astype(np.float32),
        attack_steps=attack,
        penalty_steps=penalty,
        camping_steps=camping,
        features=generator.normal(size=(count, 2, len(FEATURES))).astype(np.float32),
        provenance=Provenance(
            run="made-up", seed=3, model="m" * 64, control_timestep=0.01, game=RULES,
            labels={pools[0][0]: "antagonist 1"},
        ),
    )  # fmt: skip
