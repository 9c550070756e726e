"""TOML and JSON that somebody else may have written: site files, models, what runs leave."""

import functools
import hashlib
from collections.abc import Callable
from pathlib import Path
from random import Random
from types import SimpleNamespace
from typing import Any

import msgspec
import tomli_w

from services.jobs.play.page import read_page_url
from services.jobs.report.command import _earlier_origin
from services.jobs.report.summary import Summary
from services.jobs.reproduction import report as reproduction
from services.jobs.reproduction import sources
from services.jobs.site import section_types
from services.jobs.status import Endpoint, read_endpoint
from services.jobs.styles.command import trained_by
from services.jobs.styles.summary import StylesSummary
from services.jobs.tournament.plan import Plan
from services.jobs.tournament.results import plan_of
from services.jobs.train import pipeline
from services.robot_io.vive.calibration import Calibration, load_calibration
from shared.config.site import dump, load_section
from shared.errors import ConfigError, IdentificationError, SnapshotError
from shared.identification.dataset.manifest import read_manifest
from shared.identification.excitation import reading
from shared.identification.fitting import saved
from shared.identification.hidden.truth import Truth, read_truth
from shared.sim.parameters import dump_parameters, load_parameters
from shared.styles.bundle import Bundle, BundlePlayer, load_bundle
from shared.telemetry.door import LiveView, read_live_view
from tests.fuzz import formats, values
from tests.fuzz.target import Target, from_file
from tests.unit.policy.making import snapshot

VARIANTS = 3
PROGRAMME = b"""schema = 1

[[recording]]
name = "sines"
sha256 = "0f"
lead_m = 0.02
lead_rad = 0.1
"""
MANIFEST = b"""schema = 1
control = "pose"
continuous = ["wrist_roll"]

[model]
kind = "pr2"
arm = "right"

[[trajectory]]
name = "one"
split = "train"
initial = { wrist_roll = 0.5 }

[[trajectory]]
name = "two"
split = "test"
repeats = "one"
"""


def sections(folder: Path) -> list[Target]:
    """Return one target for each section of a site file."""
    path = folder / "site.toml"
    return [
        Target(
            name=f"sections/{name}",
            read=from_file(path, functools.partial(load_section, path, name, kind)),
            samples=(dump({name: kind()}).encode(),),
            mutate=formats.toml_text,
            refusals=(ConfigError,),
            covers=("shared.config.site:load_section", "shared.config.site:_parse"),
        )
        for name, kind in section_types().items()
    ] + [_override()]


def _override() -> Target:
    kind = section_types()["sim"]

    def read(data: bytes) -> object:
        return load_section(None, "sim", kind, [data.decode("utf-8", "replace")])

    return Target(
        name="sections/--set",
        read=read,
        samples=(
            b"sim.target_radius=0.25",
            b'sim.arms=["right", "left"]',
            b"sim.half_distance = 1.25",
        ),
        mutate=formats.line,
        refusals=(ConfigError,),
        covers=("shared.config.site:_toml_value",),
    )


def files(folder: Path) -> list[Target]:
    """Return a target for every other TOML and JSON file that a command is given or finds."""
    return [*_toml(folder), *_json(folder)]


def _toml(folder: Path) -> list[Target]:
    calibration, truth = folder / "calibration.toml", folder / "truth.toml"
    model, bundle = folder / "model.toml", folder / "bundle" / "bundle.toml"
    programme = folder / "programme.toml"
    manifest = functools.partial(read_manifest, Path("dataset.toml"))
    plain = load_parameters("nominal")
    rows: list[tuple[str, Callable[[bytes], object], tuple[bytes, ...], type[Exception], str]] = [
        ("model.toml", from_file(model, functools.partial(load_parameters, model)),
         (dump_parameters(plain).encode(),), ConfigError, "shared.sim.parameters:load_parameters"),
        ("calibration.toml",
         from_file(calibration, functools.partial(load_calibration, calibration)),
         tuple(_calibration(seed) for seed in range(VARIANTS)),
         ConfigError, "services.robot_io.vive.calibration:load_calibration"),
        ("truth.toml", from_file(truth, functools.partial(read_truth, folder)),
         tuple(_toml_of(seed, Truth) for seed in range(VARIANTS)),
         IdentificationError, "shared.identification.hidden.truth:read_truth"),
        ("programme.toml", from_file(programme, functools.partial(reading._told, programme)),
         (PROGRAMME,), IdentificationError, "shared.identification.excitation.reading:_told"),
        ("dataset.toml", manifest, (MANIFEST,), IdentificationError,
         "shared.identification.dataset.manifest:_parse"),
        ("bundle.toml", from_file(bundle, functools.partial(load_bundle, bundle.parent)),
         (_bundle(bundle.parent),), SnapshotError, "shared.styles.bundle:_decode"),
    ]  # fmt: skip
    return [
        Target(name=f"files/{name}", read=read, samples=samples, mutate=formats.toml_text,
               refusals=(error,), covers=(covers,))
        for name, read, samples, error, covers in rows
    ]  # fmt: skip


def _calibration(seed: int) -> bytes:
    """Return a calibration of unit quaternions, numbers of any kind and a time with a zone."""
    made = values.struct(Random(seed), Calibration)
    turn = {"position": [0.1, 0.2, 0.3], "orientation": [1.0, 0.0, 0.0, 0.0]}
    table = msgspec.to_builtins(made, builtin_types=(type(made.made_at),))
    table |= {"schema": 1, "torso_from_base": turn, "tracker_from_tool": turn}
    return tomli_w.dumps({key: each for key, each in table.items() if each is not None}).encode()


def _toml_of(seed: int, kind: type[msgspec.Struct]) -> bytes:
    made = msgspec.to_builtins(values.struct(Random(seed), kind))
    return tomli_w.dumps({key: each for key, each in made.items() if each is not None}).encode()


def _bundle(folder: Path) -> bytes:
    """Return a bundle whose two players' files are in the folder."""
    players: list[BundlePlayer] = []
    folder.mkdir(parents=True, exist_ok=True)
    for seed in (0, 1):
        payload = snapshot(seed, agent="protagonist").payload
        digest = hashlib.sha256(payload).hexdigest()
        (folder / f"{digest}.safetensors").write_bytes(payload)
        players.append(BundlePlayer(
            name=f"style-{seed}", role=("warm_start", "selected")[seed], round=seed, seed=seed,
            sha256=digest, style={"power": 0.5}, spread={"power": 0.1},
        ))  # fmt: skip
    made = Bundle(
        run="run", seed=1, trained_by="riposte train", selected_by="riposte styles", commit="",
        criterion="information", criterion_value=1.0, bouts=10, players=tuple(players),
    )  # fmt: skip
    return tomli_w.dumps(msgspec.to_builtins(made)).encode()


def _json(folder: Path) -> list[Target]:
    state: Any = SimpleNamespace(run="run", evaluations={}, library=list, warm_start=lambda: None)
    data: Any = SimpleNamespace(hash="", source=None)
    best = folder / "exploitability" / "best.json"
    rows: list[tuple[Path, Callable[[], object], Any, tuple[type[Exception], ...], str]] = [
        (folder / "endpoint.json", functools.partial(read_endpoint, folder), Endpoint,
         (ConfigError,), "services.jobs.status:read_endpoint"),
        (folder / "viewer.json", functools.partial(read_live_view, folder), LiveView, (),
         "shared.telemetry.door:read_live_view"),
        (folder / "page.json", functools.partial(read_page_url, folder), None, (),
         "services.jobs.play.page:read_page_url"),
        (folder / pipeline.FILE, functools.partial(pipeline.read, folder), pipeline.Pipeline, (),
         "services.jobs.train.pipeline:read"),
        (folder / "times" / "pipeline.json",
         functools.partial(reproduction._pipeline_times, folder / "times" / "pipeline.json"),
         pipeline.Pipeline, (), "services.jobs.reproduction.report:_pipeline_times"),
        (folder / "plan.json", functools.partial(plan_of, folder, state), Plan, (),
         "services.jobs.tournament.results:plan_of"),
        (folder / "summary.json", functools.partial(_earlier_origin, folder), Summary, (),
         "services.jobs.report.command:_earlier_origin"),
        (folder / "made" / "summary.json", functools.partial(trained_by, folder / "made"), Summary,
         (), "services.jobs.styles.command:trained_by"),
        (folder / "styles" / "styles.json",
         lambda: sources.styles_part(folder, []), StylesSummary, (),
         "services.jobs.reproduction.sources:styles_part"),
        (best, lambda: sources.exploitability_part(folder, state, []), None, (),
         "services.jobs.reproduction.sources:exploitability_part"),
        (folder / saved.FILE, lambda: saved.load(folder, data, 0), saved._Saved, (),
         "shared.identification.fitting.saved:load"),
    ]  # fmt: skip
    known = {
        "page.json": (b'{"url": "http://127.0.0.1:8000", "pid": 1}',),
        "best.json": (b'{"opponent": "sha256:0", "budget": 1000, "score": 1.5}',),
    }
    return [
        Target(
            name=f"files/{path.relative_to(folder)}",
            read=from_file(path, read),
            samples=known.get(path.name) or tuple(
                msgspec.json.encode(values.struct(Random(seed), kind)) for seed in range(VARIANTS)
            ),
            mutate=formats.json_text,
            refusals=errors,
            covers=(covers,),
        )
        for path, read, kind, errors, covers in rows
    ]  # fmt: skip
