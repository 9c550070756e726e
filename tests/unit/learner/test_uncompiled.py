"""A learner's process has no compiler, and learns what it learns with one."""

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]
UPDATES = """
import hashlib
import sys

import {first}
import torch
from services.learner.ppo import PolicyOptimiser
from tests.unit.learner.making import SMALL, rollout

torch.set_num_threads(1)
optimiser = PolicyOptimiser(SMALL, 3)
for sequence in range(3):
    optimiser.update([rollout(sequence)])
state = optimiser.state()
digest = hashlib.sha256(b"".join(state[name].numpy().tobytes() for name in sorted(state)))
print(digest.hexdigest(), "sympy" in sys.modules, type(sys.modules["torch._dynamo"]).__name__)
"""


def ran(program: str) -> "subprocess.CompletedProcess[str]":
    return subprocess.run(
        [sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True, timeout=100,
        check=False,
    )  # fmt: skip


def learned(first: str) -> list[str]:
    done = ran(UPDATES.format(first=first))
    assert done.returncode == 0, done.stderr
    return done.stdout.split()


def test_a_learner_learns_the_same_to_the_bit_without_the_compiler() -> None:
    with_compiler = learned("torch._dynamo")
    without = learned("services.learner.__main__")
    assert with_compiler[1:] == ["True", "module"]
    assert without[1:] == ["False", "NoCompiler"]
    assert without[0] == with_compiler[0]


def test_whoever_wants_to_compile_there_is_told_what_to_do() -> None:
    done = ran("import services.learner.uncompiled, torch; torch._dynamo.optimize")
    assert done.returncode == 1
    assert "whoever wants to compile there deletes services/learner/uncompiled.py" in done.stderr
