"""Texts that go into messages: short enough for every limit, whatever they quote."""

from typing import Final

LONGEST: Final = 500
"""Characters of a reason or an error that is told to others; the log has all of it."""
LONGEST_NAME: Final = 200
"""Characters of the name of a process, of its boot or of a rollout; a longer one is nonsense, would
swell the ledger, and a batch of names is one message."""


def clipped(text: str, longest: int = LONGEST) -> str:
    """Return a text, or its beginning and how long it is."""
    if len(text) <= longest:
        return text
    return f"{text[:longest]}... ({len(text)} characters)"
