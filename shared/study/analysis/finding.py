"""What a statistical test found, with all that a reader needs to judge it.

A test that cannot be done is a finding too: ``p`` is None and ``note`` says why.
"""

from collections.abc import Sequence

import msgspec

ALPHA = 0.05
"""Below this p counts as significant, and an assumption as violated."""
CONFIDENCE = 0.95
"""Of every interval."""
ONE = {"people": "person"}


class Estimate(msgspec.Struct, frozen=True, kw_only=True):
    """A number with its 95 % interval."""

    name: str
    value: float
    low: float | None = None
    high: float | None = None
    """None where the interval cannot be had, for too few people for instance."""
    method: str = ""
    """How the interval was made."""


class Check(msgspec.Struct, frozen=True, kw_only=True):
    """An assumption of a test, and whether the data speak against it."""

    assumption: str
    test: str
    statistic: float
    p: float
    holds: bool
    """p is at least ALPHA: nothing speaks against it, which is no proof."""


class Finding(msgspec.Struct, frozen=True, kw_only=True):
    """One test."""

    question: str
    test: str
    n: int
    """How many units went in."""
    unit: str = "people"
    symbol: str = ""
    """Of the statistic: t, F, ..."""
    statistic: float | None = None
    df: tuple[float, ...] = ()
    p: float | None = None
    """Two-sided; with every correction that ``note`` names, before the one for many tests."""
    p_adjusted: float | None = None
    """After the correction for many tests (Holm), None where there was only one."""
    family: int = 0
    """How many tests that correction was over."""
    estimate: Estimate | None = None
    """In the units of what was measured."""
    effect: Estimate | None = None
    """Without units."""
    checks: tuple[Check, ...] = ()
    beside: tuple["Finding", ...] = ()
    """The rank-based test and others of the same question."""
    left_out: tuple[str, ...] = ()
    """What did not go in, and why."""
    note: str = ""

    @property
    def decisive_p(self) -> float | None:
        """Return the p to judge by: the adjusted one where there is one."""
        return self.p if self.p_adjusted is None else self.p_adjusted

    @property
    def is_significant(self) -> bool:
        """Return whether the test was done and its p is below ALPHA."""
        return self.decisive_p is not None and self.decisive_p < ALPHA


def not_done(
    question: str,
    test: str,
    n: int,
    why: str,
    *,
    unit: str = "people",
    left_out: Sequence[str] = (),
) -> Finding:
    """Return the finding of a test that could not be done."""
    return Finding(
        question=question, test=test, n=n, unit=unit, left_out=tuple(left_out),
        note=f"not done: {why}",
    )  # fmt: skip


def check(assumption: str, test: str, statistic: float, p: float) -> Check:
    """Return a check by its p."""
    return Check(assumption=assumption, test=test, statistic=statistic, p=p, holds=p >= ALPHA)


def missing_text(count: int, what: str, why: str) -> tuple[str, ...]:
    """Return one line about what was left out, none where nothing was."""
    words = ONE.get(what, what.removesuffix("s")) if count == 1 else what
    return (f"{count} {words} left out: {why}",) if count else ()
