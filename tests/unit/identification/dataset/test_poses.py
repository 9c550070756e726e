from pathlib import Path

import numpy as np

from shared.identification.dataset.checks import poses_of
from shared.identification.dataset.tables import Table
from shared.identification.dataset.types import POSE


def test_quaternions_that_change_their_sign_from_row_to_row_get_one_sign():
    half: np.ndarray = 0.5 * np.linspace(0.0, 3.0, 7)
    quaternions = np.stack([np.cos(half), 0.0 * half, 0.0 * half, np.sin(half)], axis=1)
    signs = np.array([-1.0, 1.0, 1.0, -1.0, 1.0, -1.0, -1.0])[:, None]
    poses = np.concatenate([np.zeros((7, 3)), signs * quaternions], axis=1)
    columns = {name: poses[:, index].copy() for index, name in enumerate(POSE)}
    table = Table(Path("command.parquet"), np.arange(7), columns, ())
    np.testing.assert_allclose(poses_of(table)[:, 3:], -quaternions, atol=1e-12)
