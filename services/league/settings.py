"""What the league tells an actor that joins from a machine without the run's site file."""

from collections.abc import Sequence
from pathlib import Path

import tomli_w

from shared.config.site import raw_sections
from shared.errors import ConfigError
from shared.messages.league import RunSettings

SECTIONS = ("sim", "game", "action", "reward", "actor")
"""Actors that differ in one of the first four play another game, and are refused."""


def run_settings(site: Path | None, overrides: Sequence[str]) -> RunSettings:
    """Return the sections, and the model file where they name one.

    Raises:
        ConfigError: the site file or the model file cannot be read.
    """
    tables = raw_sections(site, SECTIONS, overrides)
    model = tables.get("sim", {}).get("model", "")
    text = ""
    if isinstance(model, str) and model.endswith(".toml"):
        try:
            text = Path(model).read_text(encoding="utf-8")
        except (OSError, UnicodeDecodeError) as error:
            raise ConfigError(f"cannot read the model {model}: {error}") from error
    return RunSettings(toml=tomli_w.dumps(tables), model=text)
