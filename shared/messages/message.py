"""What a message is: a frozen struct whose arrays say their dtype and shape."""

import dataclasses
from typing import Any, TypeAlias

import msgspec
import numpy as np
from numpy.typing import NDArray

Array: TypeAlias = NDArray[Any]
"""An array on the wire; read-only when it came from the bus. Its ``ArraySpec`` says the rest."""

Bytes: TypeAlias = NDArray[np.uint8]
"""Opaque bytes carried as ``uint8[B]``, so that they are never copied into the header."""


@dataclasses.dataclass(frozen=True)
class ArraySpec:
    """The registered dtype and shape of an array field; the wire never chooses them.

    A dimension is a number, or a name that stands for the same number everywhere in one message.
    Used as ``obs: Annotated[Array, ArraySpec("float32", ("T", "N", 27))]``.
    """

    dtype: str
    shape: tuple[int | str, ...]
    finite: bool = True
    """Refuse NaN and infinity (floating dtypes only)."""


class Message(msgspec.Struct, frozen=True, kw_only=True):
    """Base of everything that crosses the bus.

    Evolve by adding fields with defaults; never rename or retype one. Readers skip unknown fields.
    """
