"""Leaves torch's compiler out of a process that never compiles; to be imported first.

Optimisers and tensordict mark some of their functions for the compiler, and import it to do so:
2 CPU seconds and 65 MB in each learner. Here the marks are there and do nothing, as they do
nothing to code that runs as it is written (torch 2.13, ``torch/_compile.py``,
``torch/compiler/__init__.py``, ``torch/optim/optimizer.py``).
"""
# pyright: basic

import sys
import types
from collections.abc import Callable
from typing import Any

import torch

NAME = "torch._dynamo"


def _unmarked(fn: Any = None, *_: object, **__: object) -> Any:
    """Return a function, or what decorates one, as it is."""
    return fn if fn is not None else _unmarked


class NoCompiler(types.ModuleType):
    """What is asked of the compiler by code that is not compiled."""

    allow_in_graph = staticmethod(_unmarked)
    assume_constant_result = staticmethod(_unmarked)
    disable = staticmethod(_unmarked)
    graph_break: Callable[..., None] = staticmethod(lambda *_, **__: None)

    def __getattr__(self, name: str) -> Any:
        raise AttributeError(
            f"{NAME}.{name}: torch's compiler is left out of a learner; whoever wants to compile "
            "there deletes services/learner/uncompiled.py"
        )


if NAME not in sys.modules:
    sys.modules[NAME] = torch._dynamo = NoCompiler(NAME)
