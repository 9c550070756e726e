import subprocess
import sys
from pathlib import Path

import services
import shared

ROOT = Path(__file__).resolve().parents[3]


def test_the_code_under_test_is_this_checkout():
    for module in (services, shared):
        assert Path(str(module.__file__)).parents[1] == ROOT


def test_the_packages_are_found_from_any_folder(tmp_path: Path):
    code = "import services, shared; print(shared.__file__)"
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, cwd=tmp_path, timeout=30
    )
    assert done.stdout.strip() == str(ROOT / "shared" / "__init__.py"), done.stderr


def test_every_package_folder_has_an_init():
    folders = {path.parent for package in ("services", "shared")
               for path in (ROOT / package).rglob("*.py")}  # fmt: skip
    assert [folder for folder in sorted(folders) if not (folder / "__init__.py").is_file()] == []
