"""Nothing that Riposte reads is executed: no pickle anywhere, however it is called."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
MODULES = frozenset({
    "pickle", "_pickle", "cPickle", "cloudpickle", "dill", "joblib", "shelve", "marshal", "yaml",
    "jsonpickle",
})  # fmt: skip
CALLS = frozenset({"eval", "exec", "np.fromregex", "numpy.fromregex", "pd.read_pickle"})
SOURCES = sorted([*ROOT.glob("services/**/*.py"), *ROOT.glob("shared/**/*.py")])


def faults_of(text: str) -> list[str]:
    """Return what in a source could unpickle or execute what it reads."""
    found: list[str] = []
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import):
            found += [each.name for each in node.names if each.name.split(".")[0] in MODULES]
        elif isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] in MODULES:
            found.append(node.module or "")
        elif isinstance(node, ast.Call):
            name = ast.unparse(node.func)
            given = {each.arg: ast.unparse(each.value) for each in node.keywords}
            if name in CALLS:
                found.append(name)
            if given.get("allow_pickle", "False") != "False":
                found.append(f"{name}(allow_pickle=)")
            if name == "torch.load" and given.get("weights_only") != "True":
                found.append(name)
            if name in ("np.load", "numpy.load") and "allow_pickle" not in given:
                found.append(f"{name} without allow_pickle=False")
            if name in ("importlib.import_module", "__import__") and not node.args:
                found.append(name)
    return found


def test_no_code_path_unpickles() -> None:
    assert SOURCES
    found = {str(path.relative_to(ROOT)): faults_of(path.read_text("utf-8")) for path in SOURCES}
    assert {name: faults for name, faults in found.items() if faults} == {}


@pytest.mark.parametrize(
    "text",
    [
        "import pickle", "from pickle import loads", "import yaml", "eval('1')",
        "torch.load(path)", "torch.load(path, weights_only=False)", "np.load(path)",
        "np.load(path, allow_pickle=True)", "import joblib", "from marshal import loads",
    ],
)  # fmt: skip
def test_the_scan_sees_what_it_looks_for(text: str) -> None:
    assert faults_of(text)
