"""The generated parts of docs/scaling.md: from what is kept, and in step with it."""

import json
import shutil
from pathlib import Path
from typing import Any

import msgspec
import pytest

from benchmarks.scaling import document
from benchmarks.scaling.limits import GRADIENT_BYTES
from benchmarks.scaling.measure import Check, Found, Memory
from shared.errors import RiposteError
from tests.unit.scaling.test_model import PLANTED

ROOT = Path(__file__).resolve().parents[3]
MEASURED = ROOT / "benchmarks" / "scaling" / "measured.json"
KEPT: dict[str, Any] = {
    "plan": "full", "commit": "abc", "ratio": 0.1, "wall_s": 60.0,
    "machine": {"quiet": True, "cores": 2, "name": "CPU", "python": "3", "load_before": [0.1],
                "load_after": [2.0]},
    "details": msgspec.to_builtins(
        Found(
            coefficients=PLANTED, cores=2, real=(), checks=(), skipped=("1 real actors: died",),
            memory=(
                Memory(process="router-0", actors=9, resident_mb=80.0, mb_per_hour=1.0, low=0.5,
                       high=1.5, seconds=60.0),
            ),
            runs=(
                {"purpose": "crowding", "actors": 9, "samples_per_s": 100.0, "dropped_per_s": 7.0,
                 "versions_per_s": 2.0, "bytes_out_per_s": 3 * 16_800.0, "learner_thread": 0.5,
                 "router": 0.25, "league": 0.1, "rollout_samples": 5120, "batch_samples": 20480},
            ),
        )
    ),
}  # fmt: skip


def test_the_page_says_what_was_kept():
    text = (ROOT / "docs" / document.PAGE).read_text(encoding="utf-8")
    if not MEASURED.exists():
        pytest.skip("nothing measured on a quiet machine is kept: benchmarks/scaling/measured.json")
    for name, block in document.blocks(json.loads(MEASURED.read_bytes())).items():
        assert document.replaced(text, name, block) == text, (
            f"{name}: python -m benchmarks.scale --read renews the page"
        )


def test_the_page_is_renewed_with_its_figure(tmp_path: Path):
    shutil.copy(ROOT / "docs" / document.PAGE, tmp_path)
    (tmp_path / "images").mkdir()
    kept = json.loads(json.dumps(KEPT))
    kept["details"]["coefficients"]["actor_s"] = 123e-6
    document.write(tmp_path, kept)
    text = (tmp_path / document.PAGE).read_text(encoding="utf-8")
    assert "| actor | a sample | 123 |" in text
    assert "| 9 | 100 | 7 | 0.0504 MB/s | 3 | 0.50 | 0.25 |" in text
    assert "| router-0 | 9 | 80 MB | +1.0 [+0.5, +1.5] MB/h | 60 s |" in text
    assert "Not brought to work in time: 1 real actors." in text
    assert (tmp_path / document.FIGURE).read_bytes().startswith(b"\x89PNG")


def test_the_page_has_a_place_for_everything_that_is_measured():
    text = (ROOT / "docs" / document.PAGE).read_text(encoding="utf-8")
    for name in document.blocks(KEPT):
        assert "| new |" in document.replaced(text, name, "| new |")


def test_a_page_without_markers_is_refused():
    with pytest.raises(RiposteError, match="rates:begin"):
        document.replaced("# Scaling\n", "rates", "| table |")


def test_an_error_is_relative_and_a_hundredth_of_a_core_is_nothing():
    rate = Check(what="rate", actors=1, unit="samples/s", predicted=110.0, measured=100.0)
    idle = Check(what="league", actors=1, unit="cores", predicted=0.004, measured=0.002)
    assert rate.error == pytest.approx(0.1)
    assert idle.error == pytest.approx(0.2)
    found = msgspec.structs.replace(
        msgspec.convert(KEPT["details"], Found), checks=(rate, idle, idle)
    )
    assert found.error == pytest.approx(0.2)


def test_a_gradient_has_a_number_for_each_weight_of_actor_and_critic():
    actor = 27 * 64 + 64 + 64 * 64 + 64 + 64 * 6 + 6 + 6
    critic = 27 * 64 + 64 + 64 * 64 + 64 + 64 + 1
    assert 4 * (actor + critic) == GRADIENT_BYTES
