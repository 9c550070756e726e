"""Recorded bats: a ``.npy`` file, or a bout from the recorder's archive."""

from pathlib import Path

import numpy as np

from services.robot_io.links import Floats
from shared.errors import ConfigError, RiposteError
from shared.runtime.arrays import read_array

BAT = 13


def read_replay(path: Path) -> Floats:
    """Return a recorded bat: float64[T, 14], seconds from the start, then a bat's state.

    Args:
        path: a ``.npy`` file of such rows, or the folder of an archived bout (``RUN/bouts/NAME``),
            of which the antagonist's bat is taken, from the bout's start on.

    Raises:
        ConfigError: it cannot be read, or is no recording of a bat.
    """
    rows = _archived(path) if path.is_dir() else _file(path)
    if rows.ndim != 2 or rows.shape[1] != BAT + 1 or len(rows) < 2:
        raise ConfigError(
            f"{path} has the shape {rows.shape}, expected [T, 14] with T of at least 2: "
            "a time (s) and the 13 numbers of a bat's state"
        )
    lengths = np.linalg.norm(rows[:, 4:8], axis=1)
    if not np.isfinite(rows).all() or np.any(np.diff(rows[:, 0]) <= 0.0):
        raise ConfigError(f"{path} has a number that is not finite, or times that do not rise")
    if np.any(np.abs(lengths - 1.0) > 0.01):
        raise ConfigError(f"{path} has an orientation that is not of unit length")
    return rows


def _file(path: Path) -> Floats:
    try:
        return read_array(path)
    except (OSError, ValueError) as error:
        raise ConfigError(f"cannot read the recorded bat {path}: {error}") from error


def _archived(folder: Path) -> Floats:
    from shared.telemetry.archive import load_bout  # Arrow: only where it is read

    try:
        bout = load_bout(folder)
        bats = bout.bats()
    except RiposteError as error:
        raise ConfigError(f"cannot replay {folder}: {error}") from error
    rows = bout.streams["bats"]
    kept = (
        rows["antagonist_is_valid"]
        & (rows["boot"] == bout.info.robot_io_boot)
        & (rows["t_ns"] >= bout.info.started_at_ns)
    )
    seconds = rows["tick"][kept] * bout.info.control_timestep
    return np.concatenate([seconds[:, None], bats[kept, 0]], axis=1)
