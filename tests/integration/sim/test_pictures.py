import os
import subprocess
import sys
from pathlib import Path

import mujoco
import numpy as np
import pytest

from shared.errors import ConfigError
from shared.sim.batch import FencingBatch
from shared.sim.config import SimConfig
from shared.sim.export import EN_GARDE, export_mjcf
from shared.sim.model import FencingModel
from shared.sim.render import SceneRenderer

MODEL = FencingModel.build(SimConfig())


def test_the_picture_shows_both_bats_and_the_target():
    renderer = SceneRenderer(MODEL, 320, 180)
    picture = renderer.draw(MODEL.en_garde.ravel()).astype(int)
    renderer.close()
    red, green, blue = picture[..., 0], picture[..., 1], picture[..., 2]
    assert picture.shape == (180, 320, 3)
    left, right = picture[:, :160], picture[:, 160:]
    assert ((right[..., 0] > right[..., 2] + 80) & (right[..., 1] < 120)).sum() > 100
    assert (left[..., 2] > left[..., 0] + 80).sum() > 100
    assert ((red > blue + 60) & (green > blue + 20)).sum() > 200


def test_a_machine_that_cannot_draw_says_so_in_one_line():
    script = (
        "from shared.sim.config import SimConfig\n"
        "from shared.sim.model import FencingModel\n"
        "from shared.sim.render import SceneRenderer\n"
        "from shared.errors import SimulationError\n"
        "try:\n"
        "    SceneRenderer(FencingModel.build(SimConfig()), 64, 64)\n"
        "except SimulationError as error:\n"
        "    assert '\\n' not in str(error), error\n"
        "    print(error)\n"
    )
    environment = {**os.environ, "MUJOCO_EGL_DEVICE_ID": "99"}
    done = subprocess.run(
        [sys.executable, "-c", script],
        env=environment,
        cwd=Path(__file__).parents[3],
        capture_output=True,
        text=True,
        timeout=60,
        check=True,
    )
    assert "cannot draw off screen" in done.stdout


@pytest.mark.parametrize("single", [False, True])
def test_the_exported_file_is_the_same_physics_in_plain_mujoco(single: bool, tmp_path: Path):
    path = tmp_path / "scene.xml"
    export_mjcf(path, single)
    mj = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(mj)
    key = mj.key(EN_GARDE).id
    mujoco.mj_resetDataKeyframe(mj, data, key)
    size = 7 if single else 14
    assert (mj.nq, mj.nu) == (size, size)
    batch = FencingBatch(MODEL, 1)
    data.ctrl[0] += 0.05
    batch.ctrl[0, 14 - size] += 0.05
    for _ in range(100):
        mujoco.mj_step(mj, data)
        batch.step()
    assert data.qpos == pytest.approx(batch.qpos[0, 14 - size :], abs=1e-4)
    assert not np.allclose(data.qpos, MODEL.en_garde.ravel()[14 - size :], atol=1e-3)


def test_an_export_that_cannot_be_written_is_one_line(tmp_path: Path):
    with pytest.raises(ConfigError, match=r"cannot write .*No such file or directory"):
        export_mjcf(tmp_path / "missing" / "scene.xml", single=False)
