"""What was hidden, for a judge: ``truth.toml`` beside the data, which no finder reads."""

from pathlib import Path
from typing import Final

import msgspec
import tomli_w

from shared.config import toml
from shared.errors import IdentificationError

FILE: Final = "truth.toml"
SCHEMA: Final = 1


class HiddenQuantity(msgspec.Struct, frozen=True, kw_only=True):
    """One number of an effect."""

    name: str
    """As the catalogue calls it."""
    value: float
    unit: str


class HiddenEffect(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """One cause that is there to be found."""

    name: str
    """As the catalogue calls it."""
    where: str
    """As the catalogue calls it; empty: the whole arm."""
    quantities: tuple[HiddenQuantity, ...]
    way: str
    """How it entered the simulation."""
    share: float | None = None
    """Of the mean square residual on held-out recordings, noise included, what the effect makes and
    no base fit can make up for; for an event, on the recordings to fit to. None: not measured."""


class Truth(msgspec.Struct, frozen=True, kw_only=True):
    """All of ``truth.toml``."""

    schema: int = SCHEMA
    arm: str
    seed: int
    is_imperfect: bool
    """Whether the base model cannot be quite right."""
    is_gentle: bool
    has_tracker: bool
    timestep: float
    """Of the robot's own physics (s)."""
    effect: tuple[HiddenEffect, ...]
    base: dict[str, list[float]]
    """Factors of the model file's numbers, by joint or actuator."""


def truth_text(truth: Truth) -> str:
    """Return the file's text."""
    return tomli_w.dumps(msgspec.to_builtins(truth))


def read_truth(folder: Path) -> Truth:
    """Return what was hidden in a data set.

    Raises:
        IdentificationError: the file is missing or damaged.
    """
    path = folder / FILE
    try:
        return toml.decode(path.read_bytes(), Truth)
    except OSError as error:
        raise IdentificationError(f"cannot read {path}: {error.strerror}") from None
    except ValueError as error:
        raise IdentificationError(f"{path} is damaged: {error}") from None
