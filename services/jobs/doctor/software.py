"""The doctor's checks of what is installed: Python, packages, drawing, torch."""

import os
import platform
import re
import subprocess
import sys
from importlib import metadata, util
from pathlib import Path

import services
import shared
from services.jobs.doctor.finding import Finding
from shared.runtime.build import SOURCE_ROOT
from shared.runtime.process import THREAD_LIMITS

OLDEST_PYTHON = (3, 11)
PROBE_SECONDS = 120.0

DRAW = """
import sys
from pathlib import Path
from shared.sim.config import SimConfig
from shared.sim.model import FencingModel
from shared.sim.render import SceneRenderer
model = FencingModel.build(SimConfig())
renderer = SceneRenderer(model, 160, 120)
picture = renderer.draw(model.en_garde.reshape(-1))
renderer.close()
print(len(set(picture.reshape(-1, 3)[:, 0].tolist())))
"""
"""Draws one small picture and prints how many shades it has; a process of its own, because a
broken driver ends the process."""

TORCH = """
import time
begin = time.perf_counter()
import torch
print(torch.__version__, torch.get_num_threads(), f"{time.perf_counter() - begin:.1f}")
"""


def check_python() -> Finding:
    """Return the interpreter's version."""
    detail = f"{platform.python_version()} at {sys.executable}"
    if sys.version_info < OLDEST_PYTHON:
        return Finding("fail", detail, "install Python 3.11 or newer")
    return Finding("ok", detail)


def check_source() -> Finding:
    """Return where the code comes from: a foreign ``shared`` may stand first on PYTHONPATH."""
    roots = {Path(str(module.__file__)).parents[1] for module in (services, shared)}
    if roots != {SOURCE_ROOT}:
        return Finding(
            "fail",
            f"services and shared come from {' and '.join(sorted(map(str, roots)))}",
            "unset PYTHONPATH: another package is called services or shared",
        )
    try:
        found = metadata.version("riposte")
    except metadata.PackageNotFoundError:
        return Finding("fail", f"{SOURCE_ROOT}, not installed", "pip install -e . (make test does)")
    return Finding("ok", f"riposte {found} from {SOURCE_ROOT}")


def check_packages() -> Finding:
    """Return whether what Riposte needs is there, in the versions that were tested."""
    try:
        required = [text for text in metadata.requires("riposte") or [] if "extra ==" not in text]
    except metadata.PackageNotFoundError:
        return Finding("fail", "riposte is not installed", "pip install -e . (make test does)")
    names = [re.split(r"[^\w.-]", text, maxsplit=1)[0] for text in required]
    missing = [name for name in names if installed_version(name) is None]
    if missing:
        return Finding("fail", f"missing: {', '.join(missing)}", "pip install riposte")
    wrong = differing(pins(SOURCE_ROOT / "constraints.txt"))
    if wrong:
        return Finding(
            "warn",
            f"not as tested: {', '.join(wrong[:4])}{', ...' if len(wrong) > 4 else ''}",
            "pip install -c constraints.txt -e '.[dev]'",
        )
    return Finding("ok", f"{len(names)} required packages present")


def check_training() -> Finding:
    """Return whether training is installed."""
    missing = [name for name in ("torch", "rsl_rl", "matplotlib") if util.find_spec(name) is None]
    if missing:
        return Finding(
            "warn",
            f"missing: {', '.join(missing)}; actors, league and viewers work without",
            "pip install 'riposte[train]'",
        )
    return Finding("ok", f"torch {metadata.version('torch')}")


def check_pictures(folder: Path) -> Finding:
    """Return whether a picture can be drawn off screen; ``folder`` takes the probe's litter."""
    code, output = probe(DRAW, folder)
    if code == 0 and output.isdigit() and int(output) > 1:
        return Finding(
            "ok", f"off-screen drawing works (MUJOCO_GL={os.environ.get('MUJOCO_GL', '')})"
        )
    last = output.splitlines()[-1] if output else f"exit code {code}"
    return Finding(
        "warn",
        f"no off-screen drawing: {last[:160]}",
        "training works without; for pictures: apt install libegl1 libgl1-mesa-dri libopengl0",
    )


def check_torch() -> Finding:
    """Return how many threads torch takes in a supervised process, and how long it loads."""
    if util.find_spec("torch") is None:
        return Finding("ok", "torch is not installed")
    code, output = probe(TORCH, Path.cwd())
    if code != 0:
        last = output.splitlines()[-1] if output else f"exit code {code}"
        return Finding(
            "fail", f"torch does not load: {last[:160]}", "reinstall it: make clean test"
        )
    version, threads, seconds = output.split()
    detail = f"torch {version}: {threads} thread, loads in {seconds} s"
    if threads != "1":
        return Finding(
            "warn", detail, "learners slow down with spinning threads: OMP_NUM_THREADS=1"
        )
    return Finding("ok", detail)


def probe(code: str, folder: Path) -> tuple[int, str]:
    """Return exit code and last output of a small program, run as a service would be."""
    try:
        done = subprocess.run(
            [sys.executable, "-P", "-c", code],
            capture_output=True,
            text=True,
            timeout=PROBE_SECONDS,
            check=False,
            cwd=folder,
            env=os.environ | THREAD_LIMITS,
        )
    except subprocess.TimeoutExpired:
        return -1, f"not done within {PROBE_SECONDS:g} s"
    return done.returncode, (done.stdout if done.returncode == 0 else done.stderr).strip()


def installed_version(name: str) -> str | None:
    """Return the installed version of a distribution, without a local part; None if absent."""
    try:
        return metadata.version(name).partition("+")[0]
    except metadata.PackageNotFoundError:
        return None


def pins(path: Path) -> dict[str, str]:
    """Return the pinned versions by name; empty where there is no such file."""
    if not path.is_file():
        return {}
    lines = path.read_text(encoding="utf-8").splitlines()
    return dict(line.split("==", 1) for line in lines if "==" in line and line[0] != "#")


def differing(pinned: dict[str, str]) -> list[str]:
    """Return those of the installed pinned packages that are of another version."""
    found = {name: installed_version(name) for name in pinned}
    return [
        f"{name} {version} (tested {pinned[name]})"
        for name, version in found.items()
        if version is not None and version != pinned[name]
    ]
