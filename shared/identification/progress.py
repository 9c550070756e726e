"""How far a finder is, for whoever watches; it never waits for them."""

from typing import Literal, Protocol, get_args

Step = Literal[
    "noise floor", "base fit", "screen", "refit", "decide", "unexplained", "diagnostics"
]  # fmt: skip
"""Of the method, in the order in which they are done."""
STEPS: tuple[Step, ...] = get_args(Step)


class Progress(Protocol):
    """Is told how far a step is."""

    def __call__(self, step: Step, share: float, note: str = "") -> None:
        """Take note.

        Args:
            step: which; one that was told of is over when another is.
            share: of it that is done, 0 to 1.
            note: a few words on what it is at: ``start 2 of 3, residual 1.31 of noise``.
        """
        ...


def silent(step: Step, share: float, note: str = "") -> None:
    """Tell nobody."""
