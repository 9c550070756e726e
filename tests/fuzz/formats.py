"""Structure-aware mutators: a format is taken apart, broken inside and put together again."""

import json
import tomllib
from random import Random
from typing import Any

import tomli_w

from tests.fuzz import mutate, trees

RAW = 0.3
"""Share of inputs that are broken without regard to their format."""


def json_text(random: Random, data: bytes) -> bytes:
    """Break JSON: its tree, a key twice, or its bytes."""
    if random.random() < RAW:
        return mutate.raw(random, data)
    return to_json(random, trees.changed(random, json.loads(data)))


def to_json(random: Random, tree: Any) -> bytes:
    """Return a tree as JSON, NaN and nesting included; now and then with keys that come twice."""
    text = json.dumps(tree).encode()
    if random.random() < 0.1:
        start = text.find(b'"', random.randrange(len(text)))
        end = text.find(b'":', start)
        if 0 <= start < end:
            text = text[:start] + text[start : end + 2] + b"0," + text[start:]
    return trees.nested(text, b'"', b"[", b"]")


def toml_text(random: Random, data: bytes) -> bytes:
    """Break TOML: its tree, its lines, or its bytes."""
    way = random.random()
    if way < RAW:
        return mutate.raw(random, data)
    if way < 0.5:
        return _lines(random, data)
    tree = trees.changed(random, tomllib.loads(data.decode()))
    try:
        text = tomli_w.dumps(_without_none(tree) if isinstance(tree, dict) else {"x": tree})
    except (TypeError, ValueError):
        return _lines(random, data)
    return trees.nested(text.encode(errors="surrogatepass"), b'"', b"[", b"]")


def _lines(random: Random, data: bytes) -> bytes:
    lines = data.split(b"\n")
    size = mutate.size_of(random, 1 << 14)
    odd = random.choice((
        b" " * size, b"[" + b" " * size, b"#" + b"x" * size, b"x = " + b"9" * size,
        b"x = " + b"[" * size, b"x" + b".x" * size + b" = 1", b"[x" + b".x" * (size // 8) + b"]",
        b"x = 1979-05-27T07:32:00+99:99", b"x = 0x" + b"f" * size, b"x = 1e" + b"9" * 20,
        b'x = """' + b" " * size, b"x = {a = {a = {}}}", b"[[x]]\n" * (size // 8), b"\x00",
        b'" ' + b"a" * size + b'" = 1', b"x = '''\n[" + b" " * size + b"\n'''",
        random.choice(lines), b"x = \"\\U00110000\"", b"a." * (size // 8) + b"a = {}",
    ))  # fmt: skip
    lines.insert(random.randrange(len(lines) + 1), odd)
    if random.random() < 0.3:
        del lines[random.randrange(len(lines))]
    return b"\n".join(lines)


def _without_none(tree: Any) -> Any:
    if isinstance(tree, dict):
        return {key: _without_none(value) for key, value in tree.items() if value is not None}
    return (
        [_without_none(each) for each in tree if each is not None]
        if isinstance(tree, list)
        else tree
    )


def safetensors(random: Random, data: bytes, key: str) -> bytes:
    """Break a safetensors file: its header, the JSON in its metadata, a number, or its bytes.

    Args:
        random: makes the choices.
        data: a valid file.
        key: of the metadata whose value is JSON, too.
    """
    if random.random() < RAW:
        return mutate.raw(random, data)
    end = 8 + int.from_bytes(data[:8], "little")
    header, body = json.loads(data[8:end]), bytearray(data[end:])
    way = random.randrange(4)
    if way == 0:
        header = trees.changed(random, header)
    elif way == 1:
        text = to_json(random, trees.changed(random, json.loads(header["__metadata__"][key])))
        header["__metadata__"][key] = text.decode("utf-8", "replace")
    elif way == 2 and body:
        place = 4 * random.randrange(len(body) // 4 + 1)
        body[place : place + 4] = random.choice(
            (b"\x00\x00\xc0\x7f", b"\x00\x00\x80\x7f", b"\xff" * 4)
        )
    else:
        name = random.choice([name for name in header if name != "__metadata__"])
        header[name] |= {
            random.choice(("shape", "data_offsets", "dtype")): random.choice(
                ([2**40, 2**40], [0], [], [1 << 30], [0, 2**63], [8, 4], "F64", "BF16", "I8", "X")
            )
        }
    text = to_json(random, header)
    return len(text).to_bytes(8, "little") + text + bytes(body)


def line(random: Random, data: bytes) -> bytes:
    """Break one line of ``name=value``."""
    if random.random() < 0.5:
        return mutate.raw(random, data)
    name, _, value = data.partition(b"=")
    odd = _lines(random, value).replace(b"\n", b" ")
    return random.choice((name + b"=" + odd, odd + b"=" + value, name, b"=" + value, data * 2))
