import json
import subprocess
import sys
from pathlib import Path

import pytest

FOLDER = Path(__file__).resolve().parents[2] / "benchmarks"
NAMES = sorted(
    path.stem for path in FOLDER.glob("*.py") if "\nQUESTION" in path.read_text(encoding="utf-8")
)


@pytest.mark.bench
@pytest.mark.timeout(600)
@pytest.mark.parametrize("name", NAMES)
def test_a_benchmark_still_runs(name: str, tmp_path: Path):
    done = subprocess.run(
        [sys.executable, "-P", "-m", "services.cli", "bench", name, "--smoke", "--json"],
        capture_output=True,
        text=True,
        cwd=tmp_path,
        timeout=600,
    )
    assert done.returncode == 0, done.stderr[-2000:]
    report = json.loads(done.stdout)
    if "skipped" in report:
        pytest.skip(report["skipped"])
    assert {"name", "value", "unit", "limit", "ratio", "runs", "cpu_s", "wall_s"} <= report.keys()
