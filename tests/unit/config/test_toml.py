"""TOML from anybody: one kind of error, and never more time than its length is worth."""

import datetime

import msgspec
import pytest

from shared.config import toml
from shared.config.location import line_of


class Kept(msgspec.Struct):
    at: datetime.datetime
    name: str = ""


@pytest.mark.parametrize(
    ("text", "why"),
    [
        (b"x = " + b"[" * 5000, "nested too deeply"),
        (b"x = " + b"9" * 5000, "digits"),
        (b"\xff", "utf-8"),
        (b"# " + b"x" * toml.MAX_BYTES, "too many"),
        (b"a = 1\nx" + b" . 'x'" * 32 + b" = 1", "more than 32 parts .at line 2."),
        (b"[x" + b".x" * 100_000 + b"]", "more than 32 parts"),
        (b"x = ", "Invalid value"),
    ],
)
def test_what_is_no_toml_is_a_value_error(text: bytes, why: str) -> None:
    with pytest.raises(ValueError, match=why):
        toml.parse(text)


def test_keys_of_32_parts_and_long_arrays_are_read() -> None:
    assert toml.parse(b"x" + b".x" * 31 + b" = 1")
    assert len(toml.parse(b"x = [" + b"1.25, " * 10_000 + b"]")["x"]) == 10_000


def test_a_struct_comes_with_its_times() -> None:
    found = toml.decode(b'at = 2026-01-02T03:04:05Z\nname = "a"', Kept)
    assert found == Kept(datetime.datetime(2026, 1, 2, 3, 4, 5, tzinfo=datetime.UTC), "a")
    with pytest.raises(msgspec.ValidationError):
        toml.decode(b"at = 1", Kept)


@pytest.mark.timeout(20)
def test_a_line_of_spaces_is_looked_at_once() -> None:
    """Tried in every way there is, 4,000 spaces took half a minute."""
    lines = [" " * 20_000, "[" + " " * 20_000, "a" + " " * 20_000, "[ b . c ] # d", " e = 1"]
    assert line_of("\n".join(lines), ("b", "c", "e")) == 5
