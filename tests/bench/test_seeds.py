import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.bench
def test_the_interval_over_three_seeds_is_students():
    code = (
        "from benchmarks.seeds import t_interval, text\n"
        "found = t_interval([1.0, 2.0, 3.0])\n"
        "assert found['mean'] == 2.0\n"
        "assert abs(found['high'] - (2.0 + 4.303 / 3**0.5)) < 1e-9, found\n"
        "assert t_interval([5.0])['low'] is None\n"
    )
    subprocess.run([sys.executable, "-c", code], cwd=ROOT, check=True, timeout=60)
