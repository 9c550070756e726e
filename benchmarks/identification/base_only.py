"""The paper: a base fit, and nothing is named."""

from typing import Any

from shared.identification.gate.held_out import floor_of
from shared.identification.search.searched import Search, plain_losses


def base_only(found: Search) -> dict[str, Any]:
    """Return what the base fit is worth: it is what the others' shares are measured against."""
    return {"name": "", "share_removed": 0.0, "loss": _loss(found)}


def share_removed(found: Search, loss: float) -> float:
    """Return the share of the explainable held-out loss that a model with a loss removes."""
    base = _loss(found)
    return (base - loss) / (base - floor_of(base))


def _loss(found: Search) -> float:
    """Return what the base fit leaves, as a verdict tells it."""
    return float(plain_losses(found)[1].mean())
