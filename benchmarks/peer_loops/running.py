"""Runs a peer on its work, in a process of its own, and kills what it leaves."""

import contextlib
import os
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import msgspec

from benchmarks.environments import interpreter
from benchmarks.harness import ROOT
from benchmarks.peer_loops.work import Timing, Work
from services.jobs.settings import Settings

DEADLINE = 300.0
"""Longest that one run of a peer may take to start, warm up and end, beside its window (s)."""


class Peer(msgspec.Struct, frozen=True, kw_only=True):
    """One way in which a project can run."""

    name: str
    module: str
    """Of `benchmarks.peer_loops`."""
    requirements: str = ""
    """Which environment; empty: ours."""
    mode: str = ""
    num_envs: int = 128
    threads: int = 1
    physics_threads: int = 1
    is_distributed: bool = False
    """Whether it is held to the goal of those that spread over processes."""


class PeerFailedError(Exception):
    """A peer did not come to the end of its window; says how it ended."""


def work_of(peer: Peer, settings: Settings, opponent: Path, seconds: float) -> Work:
    """Return what a peer is given: our settings, in plain numbers."""
    cfg = settings.learner
    return Work(
        opponent=str(opponent), num_envs=peer.num_envs, batch_samples=cfg.batch_samples,
        hidden_dims=cfg.hidden_dims, epochs=cfg.epochs, minibatches=cfg.minibatches,
        learning_rate=cfg.learning_rate, gamma=cfg.gamma, gae_lambda=cfg.gae_lambda,
        clip=cfg.clip, entropy_coef=cfg.entropy_coef, value_loss_coef=cfg.value_loss_coef,
        max_grad_norm=cfg.max_grad_norm, initial_std=cfg.initial_std, mode=peer.mode,
        seconds=seconds, threads=peer.threads, physics_threads=peer.physics_threads,
        score_weight=settings.league.score_weights[0],
        shaping_weight=settings.league.shaping_weights[0],
    )  # fmt: skip


def run(peer: Peer, work: Work) -> dict[str, Any]:
    """Return what a peer did in its window.

    Raises:
        CannotInstallError: its environment cannot be made.
        PeerFailedError: it did not come to its end.
    """
    python = interpreter(peer.requirements) if peer.requirements else Path(sys.executable)
    work = msgspec.structs.replace(work, spawned_at=time.time())  # noqa: TID251
    command = [python, "-m", f"benchmarks.peer_loops.{peer.module}", msgspec.json.encode(work)]
    with (
        tempfile.TemporaryDirectory(prefix="riposte-peer-", ignore_cleanup_errors=True) as folder,
        (Path(folder) / "said").open("w+", encoding="utf-8") as said,  # a worker holds a pipe open
    ):
        started = subprocess.Popen(
            command, cwd=folder, stdout=said, stderr=subprocess.STDOUT,
            env=os.environ | {"PYTHONPATH": str(ROOT), "RAY_TMPDIR": folder},
            start_new_session=True,
        )  # fmt: skip
        try:
            started.wait(timeout=DEADLINE + work.seconds)
        except subprocess.TimeoutExpired:
            raise PeerFailedError(f"{peer.name} had not ended after {DEADLINE:g} s more") from None
        finally:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(started.pid, signal.SIGKILL)
            started.wait()
        said.seek(0)
        lines = said.read().strip().splitlines()
    if started.returncode or not lines:
        raise PeerFailedError(f"{peer.name} ended with {started.returncode}: {lines[-1:]}")
    timing = msgspec.json.decode(lines[-1], type=Timing)
    return msgspec.to_builtins(timing) | {
        "peer": peer.name,
        "mode": peer.mode,
        "num_envs": peer.num_envs,
        "threads": peer.threads,
        "physics_threads": peer.physics_threads,
        "samples_per_s": timing.samples / timing.wall_s,
        "samples_per_cpu_s": timing.samples / timing.cpu_s,
    }


def fresh_protagonist(settings: Settings, path: Path) -> Path:
    """Write the snapshot of an untrained protagonist, from a process of its own: it needs torch.

    Args:
        settings: whose networks.
        path: of the file.
    """
    command = [sys.executable, "-m", "benchmarks.peer_loops.opponent", str(path)]
    subprocess.run(command, cwd=ROOT, check=True, timeout=120)
    return path
