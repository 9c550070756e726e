"""The registry names every entrance: whoever adds a reader of foreign bytes adds a target."""

import ast
import importlib
import sys
import types
from collections.abc import Iterator
from pathlib import Path

import msgspec
import pytest

from services.jobs.site import section_types
from shared.config.site import SECTIONS
from shared.messages.message import Message
from tests.fuzz.entrances import wire
from tests.fuzz.registry import GROUPS, NO_ENTRANCES, targets_of
from tests.fuzz.target import Target

pytestmark = pytest.mark.slow
ROOT = Path(__file__).parents[2]
READERS = frozenset({
    "msgspec.json.decode", "msgspec.msgpack.decode", "msgspec.toml.decode", "toml.parse",
    "toml.decode", "tomllib.loads", "tomllib.load", "json.loads", "json.load", "pickle.loads",
    "sqlite3.connect", "np.load", "numpy.load", "pq.read_table", "pq.ParquetFile",
    "pa.ipc.open_stream", "pa.ipc.open_file", "pyarrow.csv.read_csv", "csv.reader",
    "csv.DictReader", "xmlrpc.client.loads", "yaml.safe_load", "struct.unpack",
    "struct.unpack_from", "onnx.load", "onnx.load_from_string", "torch.load", "zipfile.ZipFile",
    "AnyReader", "read_array", "table_of", "load", "_decode_header", "_ASKS.decode",
    "_RESEARCHER.decode", "_PARTICIPANT.decode",
    "int.from_bytes", "np.frombuffer", "POSE.unpack", "_POINTER.unpack", "WORD.unpack_from",
    "_FRAME.unpack", "_FRAME.unpack_from", "_PREFIX.unpack_from", "kind.from_string",
    "kind.from_file", "ET.fromstring", "deserialize_ros1", "reader.deserialize",
})  # fmt: skip
"""Calls that turn bytes into values. ``load`` is that of safetensors, where it is imported."""


@pytest.fixture(scope="module")
def targets(tmp_path_factory: pytest.TempPathFactory) -> list[Target]:
    folder = tmp_path_factory.mktemp("targets")
    return [each for group in GROUPS for each in targets_of(group.name, folder / group.name)]


def _calls(tree: ast.AST, text: str, place: str = "") -> Iterator[tuple[str, str]]:
    """Yield where each call of a reader is, and what it calls."""
    for node in ast.iter_child_nodes(tree):
        inside = place
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            inside = f"{place}.{node.name}".lstrip(".")
        if isinstance(node, ast.Call):
            name = ast.unparse(node.func)
            is_reader = name in READERS or name.endswith(("Decoder", ".deserialize_ros1"))
            if is_reader and (name != "load" or "safetensors" in text):
                yield inside, name
        yield from _calls(node, text, inside)


def found_readers() -> dict[str, set[str]]:
    """Return every function of services and shared that turns bytes into values."""
    found: dict[str, set[str]] = {}
    for path in sorted([*ROOT.glob("services/**/*.py"), *ROOT.glob("shared/**/*.py")]):
        module = ".".join(path.relative_to(ROOT).with_suffix("").parts)
        if module.startswith("shared.testing"):
            continue
        text = path.read_text("utf-8")
        for place, call in _calls(ast.parse(text), text):
            found.setdefault(f"{module}:{place}", set()).add(call)
    return found


def test_every_function_that_reads_bytes_is_fuzzed_or_is_no_entrance(
    targets: list[Target],
) -> None:
    known = {each for target in targets for each in target.covers} | set(NO_ENTRANCES)
    lost = {place: calls for place, calls in found_readers().items() if place not in known}
    assert not lost, "add a target in tests/fuzz/entrances, or say in NO_ENTRANCES why not"


def test_no_exemption_outlives_its_function() -> None:
    assert set(NO_ENTRANCES) <= set(found_readers())
    assert all(NO_ENTRANCES.values())


def _messages(kind: type[Message]) -> Iterator[type[Message]]:
    for each in kind.__subclasses__():
        yield each
        yield from _messages(each)


def test_every_message_type_is_fuzzed() -> None:
    for path in sorted((ROOT / "shared" / "messages").glob("*.py")):
        importlib.import_module(f"shared.messages.{path.stem}")
    own = {each for each in _messages(Message) if each.__module__.startswith("shared.")}
    fields = [str(field.type) for each in own for field in msgspec.structs.fields(each)]
    parts = {each for each in own if any(f".{each.__qualname__}" in field for field in fields)}
    assert own - parts <= set(wire.KINDS) <= own


def test_every_section_of_a_site_file_is_fuzzed(targets: list[Target]) -> None:
    names = {each.name for each in targets if each.group == "sections"}
    assert names == {f"sections/{name}" for name in (*SECTIONS, "--set")}
    assert set(section_types()) == set(SECTIONS)
    assert all(issubclass(kind, msgspec.Struct) for kind in section_types().values())


def test_every_sample_goes_through_what_its_target_covers(targets: list[Target]) -> None:
    """A target that does not meet its own entrance would fuzz nothing."""
    for target in targets:
        seen: set[str] = set()

        def note(frame: types.FrameType, event: str, _: object, seen: set[str] = seen) -> None:
            if event == "call":
                name = frame.f_globals.get("__name__")
                seen.add(f"{name}:{frame.f_code.co_qualname}")

        sys.setprofile(note)
        try:
            target.read(target.samples[0])
        finally:
            sys.setprofile(None)
        assert set(target.covers) <= seen, target.name


def test_names_of_targets_are_their_own(targets: list[Target]) -> None:
    names = [each.name for each in targets]
    assert len(names) == len(set(names))
    assert {each.group for each in targets} == {group.name for group in GROUPS}
