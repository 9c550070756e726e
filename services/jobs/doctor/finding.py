"""What a check of the doctor found."""

from typing import Literal

import msgspec


class Finding(msgspec.Struct, frozen=True):
    """One line of the doctor's report."""

    state: Literal["ok", "warn", "fail"]
    """``fail`` keeps Riposte from working, ``warn`` from working well."""
    detail: str
    """What is there, with numbers."""
    advice: str = ""
    """What to do; empty when nothing is to be done."""
