"""Stage `train`: a warm-start pair for each model and seed, by `riposte train --phase one`."""

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

from services.jobs.runs import LEDGER, state_of
from services.league.history import RunState
from shared.errors import ConfigError, RiposteError
from shared.policy.snapshot import Snapshot, unpack
from studies.closing_the_loop.protocol import Condition, Folders, Protocol, need, runs_of

Say = Callable[[str], None]


def train(protocol: Protocol, folders: Folders, say: Say) -> None:
    """Train what is not trained yet; a run that was stopped goes on where it was.

    Raises:
        RiposteError: a training failed.
    """
    left = [run for run in runs_of(protocol) if pair_of(folders.training(*run)) is None]
    for number, (condition, seed) in enumerate(left, 1):
        say(f"training {number} of {len(left)}: {condition}, seed {seed}")
        folder = folders.training(condition, seed)
        words = _words(protocol, folders, condition, seed, folder)
        done = subprocess.run([sys.executable, "-m", "services.cli", "train", *words], check=False)
        if done.returncode != 0 or pair_of(folder) is None:
            raise RiposteError(
                f"training {folder.name} ended with {done.returncode}; the same command goes on"
            )


def pair_of(folder: Path) -> tuple[str, str] | None:
    """Return antagonist and protagonist of a finished run; None where it is not."""
    if not (folder / LEDGER).exists():
        return None
    state: RunState = state_of(folder)
    return state.warm_start() if state.finished else None


def snapshot_of(folder: Path, side: int) -> Snapshot:
    """Return what a run trained: 0 the antagonist, 1 the protagonist.

    Raises:
        ConfigError: the run is not finished.
    """
    pair = pair_of(folder)
    if pair is None:
        raise ConfigError(f"{folder} is not trained: run the stage 'train' first")
    digest = pair[side].removeprefix("sha256:")
    return unpack((folder / "snapshots" / f"{digest}.safetensors").read_bytes(), digest)


def _words(
    protocol: Protocol, folders: Folders, condition: Condition, seed: int, folder: Path
) -> list[str]:
    if (folder / LEDGER).exists():
        return ["--resume", "--out", str(folder)]
    model = folders.model(condition)
    if condition != "nominal":
        need(Path(model), "find")
    antagonist, protagonist = protocol.updates
    settings = (
        f'sim.model="{model}"',
        f"league.iterations={protocol.iterations}",
        f"league.antagonist_updates={antagonist}",
        f"league.protagonist_updates={protagonist}",
        "train.record=false",
        *protocol.train,
    )
    words = ["--phase", "one", "--seed", str(seed), "--actors", "1", "--out", str(folder)]
    return [*words, *(word for each in settings for word in ("--set", each))]
