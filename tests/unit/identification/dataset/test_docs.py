"""docs/dataset.md says what the code does."""

import re
import types
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

from shared.identification.dataset.reading import read_dataset

ROOT = Path(__file__).parents[4]
TEXT = (ROOT / "docs" / "dataset.md").read_text()


class DataFrame:
    """As much of pandas as the example uses."""

    def __init__(self, columns: dict) -> None:
        self._columns = columns

    def to_parquet(self, path: Path) -> None:
        pq.write_table(pa.table(self._columns), path)


def test_the_example_writes_a_data_set(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    code = re.search(r"```python\n(.*?)```", TEXT, re.DOTALL)[1]
    code = code.replace("import pandas as pd\n", "")
    pandas = types.SimpleNamespace(DataFrame=DataFrame)
    exec(compile(code, "docs/dataset.md", "exec"), {"pd": pandas})
    found = read_dataset(Path("my_arm"))
    assert found.joints == found.actuators == ("elbow",)
    assert [each.name for each in found.caveats] == [
        "moving_start", "moving_start", "no_repeat", "no_tracker", "no_velocity", "no_effort",
        "one_program",
    ]  # fmt: skip


def test_every_caveat_and_no_other_is_in_the_table():
    folder = ROOT / "shared" / "identification" / "dataset"
    source = "".join(path.read_text() for path in folder.glob("*.py"))
    given = set(re.findall(r'Caveat\(\s*"(\w+)"', source))
    given |= set(re.findall(r'"(no_\w+)"', source)) | {"partial_velocity", "partial_effort"}
    table = TEXT[TEXT.index("## Caveats") :]
    told = {name for row in re.findall(r"^\| (`.*?) \|", table, re.MULTILINE)
            for name in re.findall(r"`(\w+)`", row)}  # fmt: skip
    assert given == told
