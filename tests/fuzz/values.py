"""Valid values of any annotation that a struct of Riposte has, from a seed."""

import datetime
import math
import types
from random import Random
from typing import Annotated, Any, Literal, Union, get_args, get_origin

import msgspec
import numpy as np

from shared.messages.message import ArraySpec, Message

WORDS = ("", "a", "learner-0", "sha256:" + "0" * 64, "wörter", "x" * 40)


def value(random: Random, annotation: Any) -> Any:
    """Return a value of a type."""
    plain = {
        int: lambda: random.choice((0, 1, 7, 2**40)),
        float: lambda: random.uniform(-2.0, 2.0),
        str: lambda: random.choice(WORDS),
        bool: lambda: random.random() < 0.5,
        types.NoneType: lambda: None,
        Any: lambda: random.choice((None, 1, "x", [1.5])),
        object: lambda: random.choice((None, 1, "x", [1.5])),
        datetime.datetime: lambda: datetime.datetime(2026, 1, 2, tzinfo=datetime.UTC),
    }
    if annotation in plain:
        return plain[annotation]()
    if isinstance(annotation, type) and issubclass(annotation, msgspec.Struct):
        return struct(random, annotation)
    origin, args = get_origin(annotation), get_args(annotation)
    if origin is Annotated:
        return value(random, args[0])
    if origin is Literal:
        return random.choice(args)
    if origin in (Union, types.UnionType):
        return value(random, random.choice(args))
    if origin is tuple and args[-1] is not ...:
        return tuple(value(random, each) for each in args)
    if origin in (tuple, list):
        return origin(value(random, args[0]) for _ in range(random.randrange(3)))
    if origin is dict:
        return {value(random, args[0]): value(random, args[1]) for _ in range(random.randrange(3))}
    raise AssertionError(f"no value of {annotation}: add one")


def struct(random: Random, kind: type[msgspec.Struct]) -> Any:
    """Return a struct; a field with a default has it half of the time."""
    fields = {
        field.name: value(random, field.type)
        for field in msgspec.structs.fields(kind)
        if field.required or random.random() < 0.5
    }
    return kind(**fields)


def message(random: Random, kind: type[Message]) -> Message:
    """Return a message with arrays of its registered types and shapes."""
    generator = np.random.default_rng(random.getrandbits(32))
    dims: dict[str, int] = {}
    fields: dict[str, Any] = {}
    for field in msgspec.structs.fields(kind):
        spec = next((each for each in getattr(field.type, "__metadata__", ())
                     if isinstance(each, ArraySpec)), None)  # fmt: skip
        if spec is None:
            fields[field.name] = value(random, field.type)
            continue
        for dim in spec.shape:
            if isinstance(dim, str):
                dims.setdefault(dim, random.randrange(4))
        shape = tuple(dims[dim] if isinstance(dim, str) else dim for dim in spec.shape)
        dtype, count = np.dtype(spec.dtype), math.prod(shape)
        flat = (
            generator.standard_normal(count)
            if dtype.kind == "f"
            else generator.integers(0, 2, count)
        )
        fields[field.name] = flat.astype(dtype).reshape(shape)
    return kind(**fields)
