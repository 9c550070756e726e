"""Checks an installed wheel from outside the checkout: whole, importable, usable without torch."""

import importlib.util
import subprocess
import sys
from pathlib import Path

import services
import shared


def main(checkout: Path) -> None:
    """Fail with one line unless the installation is whole."""
    site_packages = Path(shared.__file__).parents[1]
    assert site_packages.name == "site-packages", f"shared comes from {shared.__file__}"
    assert Path(services.__file__).parents[1] == site_packages, services.__file__
    assert importlib.util.find_spec("torch") is None, "the core installation pulled in torch"
    for package in ("services", "shared"):
        wanted = {
            path.relative_to(checkout)
            for path in (checkout / package).rglob("*")
            if path.is_file() and path.suffix not in {".pyc"}
        }
        lost = sorted(str(path) for path in wanted if not (site_packages / path).is_file())
        assert not lost, f"not in the wheel: {', '.join(lost)}"
    riposte = Path(sys.executable).with_name("riposte")
    for flags in (["--version"], ["--help"], ["doctor", "--help"]):
        subprocess.run([riposte, *flags], check=True, timeout=60, stdout=subprocess.DEVNULL)
    print(f"wheel: whole and importable from {site_packages}")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
