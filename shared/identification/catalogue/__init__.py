"""The causes that are looked for: a module each, which has ``EFFECT``. Adding one is one file."""

import importlib
import pkgutil

from shared.identification.effect import Effect


def effects() -> tuple[Effect, ...]:
    """Return the whole catalogue in the order of its modules' names."""
    names = sorted(module.name for module in pkgutil.iter_modules(__path__))
    return tuple(importlib.import_module(f"{__name__}.{name}").EFFECT for name in names)
