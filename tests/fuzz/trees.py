"""Broken trees: what JSON, TOML and MessagePack hold, changed where it hurts."""

import re
from random import Random
from typing import Any

from tests.fuzz.mutate import size_of

NEST = "<nest %06d>"
"""Stands for lists in lists, that many deep, which no encoder would write."""
_NEST = re.compile(rb"<nest (\d{6})>")

Tree = Any


def hostile(random: Random) -> Tree:
    """Return a value that nobody expects."""
    kind = random.randrange(6)
    if kind == 0:
        return random.choice((None, True, False, [], {}, "", [[]], {"": ""}))
    if kind == 1:
        return random.choice(
            (0, -1, 1, 255, 2**31, 2**32, 2**53 + 1, 2**63 - 1, -(2**63), 2**64 - 1)
        )
    if kind == 2:
        return random.choice((float("nan"), float("inf"), -float("inf"), 1e308, -0.0, 5e-324))
    if kind == 3:
        return random.choice(("\x00", "../../etc/passwd", "/dev/zero", "\U0010ffff", "nan", "a.b"))
    if kind == 4:
        size = size_of(random, 1 << 14)
        return random.choice(("x" * size, " " * size, [0] * size, [[]] * size))
    return NEST % random.choice((10, 200, 5000, 100_000))


def changed(random: Random, tree: Tree) -> Tree:
    """Return the tree with one to three places changed."""
    for _ in range(random.choice((1, 1, 1, 2, 3))):
        tree = _at(random, tree, 6)
    return tree


def _at(random: Random, tree: Tree, depth: int) -> Tree:
    """Change the tree here, or somewhere below."""
    if not depth or not isinstance(tree, dict | list) or not tree or random.random() < 0.25:
        return _here(random, tree)
    if isinstance(tree, dict):
        key = random.choice(list(tree))
        return {**tree, key: _at(random, tree[key], depth - 1)}
    index = random.randrange(len(tree))
    return [*tree[:index], _at(random, tree[index], depth - 1), *tree[index + 1 :]]


def _here(random: Random, tree: Tree) -> Tree:
    way = random.randrange(4)
    if isinstance(tree, dict) and tree and way:
        key = random.choice(list(tree))
        rest = {name: value for name, value in tree.items() if name != key}
        if way == 1:
            return rest
        if way == 2:
            return {**rest, random.choice(("", key + "x", "__class__", "\x00")): tree[key]}
        return {**tree, random.choice(("extra", "__proto__", "a b")): hostile(random)}
    if isinstance(tree, list) and tree and way:
        item = random.choice(tree)
        return random.choice(
            (tree[1:], tree[:-1], [*tree, item], tree * 2, [item] * size_of(random, 1 << 12))
        )
    if isinstance(tree, int | float) and not isinstance(tree, bool) and way == 1:
        return random.choice((-tree, tree + 1, str(tree), [tree], tree * 2**70))
    if isinstance(tree, str) and way == 1:
        return random.choice((tree[:-1], tree * 2, tree.encode().hex(), 0, [tree], {tree: tree}))
    return hostile(random)


def nested(data: bytes, quote: bytes, opening: bytes, closing: bytes, inner: bytes = b"") -> bytes:
    """Put real nesting where an encoder wrote the word that stands for it."""
    whole = re.compile(quote + _NEST.pattern + (b'"' if quote == b'"' else b""))
    return whole.sub(lambda m: opening * int(m[1]) + inner + closing * int(m[1]), data)
