"""Bytes that nobody meant: a data set or one clear error, never anything else."""

import tempfile
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from shared.errors import IdentificationError
from shared.identification.dataset.reading import read_dataset
from tests.unit.identification.dataset.folders import MANIFEST, written


@pytest.fixture(scope="module")
def sound():
    with tempfile.TemporaryDirectory() as name:
        yield {suffix: written(Path(name) / suffix[1:], suffix) for suffix in (".parquet", ".csv")}


def accepted(folder: Path) -> bool:
    """Return whether it is a data set; anything but a clear error fails."""
    try:
        read_dataset(folder)
    except IdentificationError as error:
        text = str(error)
        assert text
        assert "\n" not in text
        return False
    return True


@st.composite
def damages(draw: st.DrawFn) -> list[tuple[float, bytes, int]]:
    """Return what is put where (a share of the file), and how many bytes it takes the place of."""
    return draw(st.lists(
        st.tuples(st.floats(0.0, 1.0), st.binary(max_size=8), st.integers(0, 8)),
        min_size=1, max_size=4,
    ))  # fmt: skip


def damaged(data: bytes, places: list[tuple[float, bytes, int]]) -> bytes:
    for share, put, gone in places:
        at = int(share * len(data))
        data = data[:at] + put + data[at + gone :]
    return data


@pytest.mark.parametrize("suffix", [".parquet", ".csv"])
@pytest.mark.parametrize("name", ["command", "joints", "tracker"])
@given(places=damages())
@settings(
    max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
def test_a_damaged_table(sound, suffix, name, places):
    path = sound[suffix] / "two" / f"{name}{suffix}"
    data = path.read_bytes()
    try:
        path.write_bytes(damaged(data, places))
        accepted(sound[suffix])
    finally:
        path.write_bytes(data)


@pytest.mark.parametrize("suffix", [".parquet", ".csv"])
@given(data=st.binary(max_size=200))
@settings(max_examples=25, deadline=None)
def test_a_table_of_any_bytes(sound, suffix, data):
    path = sound[suffix] / "two" / f"joints{suffix}"
    before = path.read_bytes()
    try:
        path.write_bytes(data)
        assert not accepted(sound[suffix])
    finally:
        path.write_bytes(before)


@given(places=damages())
@settings(max_examples=80, deadline=None)
def test_a_damaged_manifest(sound, places):
    path = sound[".parquet"] / "dataset.toml"
    try:
        path.write_bytes(damaged(MANIFEST.encode(), places))
        accepted(sound[".parquet"])
    finally:
        path.write_text(MANIFEST)


VALUES = st.recursive(
    st.sampled_from([
        "1", "true", "nan", "-inf", '"x"', '""', '"one"', "1979-05-27", "[]", "{}", "1e400",
        str(10**30), str(10**400), '"\\u0000"',
    ]),
    lambda inner: st.lists(inner, max_size=3).map(lambda many: f"[{', '.join(many)}]")
    | st.lists(inner, max_size=2).map(
        lambda many: "{" + ", ".join(f"k{i} = {v}" for i, v in enumerate(many)) + "}"
    ),
    max_leaves=4,
)  # fmt: skip
KEYS = ["schema", "control", "kind", "path", "name", "split", "repeats", "initial", "continuous",
        "model", "trajectory", "tracked", "arm", "initial_velocity", "generator"]  # fmt: skip


@given(key=st.sampled_from(KEYS), value=VALUES, line=st.integers(0, 14))
@settings(max_examples=80, deadline=None)
def test_a_manifest_with_any_value_at_any_key(sound, key, value, line):
    path = sound[".parquet"] / "dataset.toml"
    lines = MANIFEST.splitlines()
    try:
        path.write_text("\n".join([*lines[:line], f"{key} = {value}", *lines[line:]]))
        accepted(sound[".parquet"])
        kept = [each for each in lines if not each.startswith(f"{key} =")]
        path.write_text("\n".join([f"{key} = {value}", *kept]))
        accepted(sound[".parquet"])
    finally:
        path.write_text(MANIFEST)
