"""A model file whose drives give less than the arm's names no cause for it."""

from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np

from shared.identification.conclusion.model_file import model_file
from shared.identification.dataset.types import ModelSource
from shared.identification.find import identify
from tests.measured import measure


def test_limits_that_the_arm_goes_beyond_are_left_out_and_told(tmp_path: Path):
    dataset = measure(tmp_path, np.random.default_rng(0))
    path = dataset.source.path
    assert path is not None
    own = 'name="lift" joint="lift" kp="200" kv="10"'
    weak = tmp_path / "weak.xml"
    weak.write_text(path.read_text().replace(own, f'{own} forcerange="-4 4"'))
    asked = replace(dataset, source=ModelSource("mjcf", weak, tracked="tool"))
    verdict = identify(asked).verdict
    assert verdict.verdict == "none", verdict.sentence
    assert verdict.sentence.endswith("without the file's limits of the drives at lift.")
    assert any("forcerange" in each for each in verdict.caveats)
    assert verdict.unlimited == ("lift",)
    model = mujoco.MjModel.from_xml_string(model_file(asked, verdict).text)
    np.testing.assert_allclose(model.actuator("lift").forcerange, [-40.0, 40.0])
