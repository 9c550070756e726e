"""The recording has the measured arm, the simulated ones and their residuals."""

from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest

from services.jobs.identify.overlay import PAUSE, overlay_of, write_overlay
from shared.errors import RiposteError
from shared.identification.arm.subject import plant_of
from shared.identification.conclusion.model_file import model_file
from shared.identification.dataset.types import Dataset
from shared.sim.plant.looks import Looks
from shared.sim.plant.plant import pr2
from shared.telemetry.identification_recording import path_of, write_overlay_recording
from shared.telemetry.rrd import trim
from tests.integration.identify_job.arms import pendulum_dataset, verdict_of
from tests.unit.identify_job.examples import JOINTS, example

PR2 = Looks(pr2("right", None))


def test_a_pr2_looks_like_itself_and_stands_on_no_floor() -> None:
    names = set(PR2.bodies)
    assert {"protagonist/torso", "protagonist/wrist_roll"} <= names
    assert len(PR2.solids) > 20
    assert all(np.abs(solid.position).max() < 3.0 for solid in PR2.solids)


def test_an_mjcf_arm_looks_like_its_geoms(tmp_path: Path) -> None:
    looks = Looks(plant_of(pendulum_dataset(tmp_path)))
    assert [solid.kind for solid in looks.solids] == ["capsule", "capsule"]
    positions, _ = looks.poses(np.array([[0.0, 0.0], [np.pi / 2, 0.0]]))
    lower = looks.bodies.index("lower")
    assert positions[0, lower] == pytest.approx([0.0, 0.0, 0.7], abs=1e-6)
    assert positions[1, lower] == pytest.approx([-0.3, 0.0, 1.0], abs=1e-6)


def test_an_arm_without_anything_to_look_at_has_bones(tmp_path: Path) -> None:
    dataset = pendulum_dataset(tmp_path)
    path = tmp_path / "pendulum.xml"
    inertial = '<inertial pos="0 0 -.1" mass="1" diaginertia=".01 .01 .01"/>'
    bare = path.read_text()
    for geom in ("0 0 0 0 0 -.3", "0 0 0 0 0 -.25"):
        start = bare.index(f'<geom type="capsule" size=".02" fromto="{geom}"')
        bare = bare[:start] + inertial + bare[bare.index("/>", start) + 2 :]
    path.write_text(bare)
    looks = Looks(plant_of(dataset))
    assert "capsule" in {solid.kind for solid in looks.solids}


WEDGE = "v 0 0 0\nv .1 0 0\nv 0 .1 0\nv 0 0 -.3\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
"""A tetrahedron, as an OBJ file has it."""


def dataset_with(dataset: Dataset, folder: Path) -> Dataset:
    """Return the data set with its model file written again into another folder."""
    folder.mkdir()
    (folder / "model.xml").write_text(model_file(dataset, verdict_of(dataset)).text)
    source = replace(dataset.source, path=folder / "model.xml")
    return replace(dataset, source=source)


def test_an_arm_of_meshes_is_drawn_with_them(tmp_path: Path) -> None:
    dataset = pendulum_dataset(tmp_path)
    (tmp_path / "looks").mkdir()
    (tmp_path / "looks/wedge.obj").write_text(WEDGE)
    path = tmp_path / "pendulum.xml"
    bare = path.read_text().replace(
        'angle="radian"/>',
        'angle="radian" meshdir="looks"/><asset><mesh file="wedge.obj"/></asset>',
    )
    link = '<geom type="capsule" size=".02" fromto="0 0 0 0 0 -.3" mass="0.8"/>'
    shape = '<geom type="mesh" mesh="wedge" mass="0.8" rgba="1 0 0 1"/>'
    assert link in bare
    path.write_text(bare.replace(link, shape))
    looks = Looks(plant_of(dataset))
    upper = next(solid for solid in looks.solids if looks.bodies[solid.body] == "upper")
    assert upper.vertices is not None
    assert upper.faces is not None
    assert (upper.kind, upper.vertices.shape, upper.faces.shape) == ("mesh", (4, 3), (4, 3))
    # MuJoCo moves a mesh to its centre of mass; placed it is where the file has it.
    turned = np.empty(3)
    placed: list[list[float]] = []
    for vertex in upper.vertices.astype(np.float64):
        mujoco.mju_rotVecQuat(turned, vertex, np.array(upper.quaternion))
        placed.append([round(float(each), 4) for each in turned + np.array(upper.position)])
    corners = [[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [0.0, 0.0, -0.3]]
    assert sorted(placed) == sorted(corners)
    found = example("none", ("shoulder", "elbow"), has_tracker=False)
    write_overlay(tmp_path / "recording.rrd", dataset, found.verdict, found.evidence)
    content = (tmp_path / "recording.rrd").read_bytes()
    assert b"/arms/measured/solid/" in content
    assert b"Mesh3D" in content
    assert Looks(plant_of(dataset_with(dataset, tmp_path / "elsewhere"))).solids[0].kind == "mesh"


def test_trajectories_lie_end_to_end_held_out_first() -> None:
    found = example("unexplained")
    overlay = overlay_of("friday", PR2, found.verdict, found.evidence)
    assert [span.name for span in overlay.trajectories][:2] == [
        "sines test (test)", "swings test (test)",
    ]  # fmt: skip
    for one, other in zip(overlay.trajectories, overlay.trajectories[1:], strict=False):
        assert other.begin == pytest.approx(one.end + PAUSE)
    swings = overlay.trajectories[1]
    pushed = overlay.unexplained[0]
    assert pushed.begin == pytest.approx(swings.begin + 7.7)
    assert set(overlay.arms) == {"measured", "base_fit"}
    assert overlay.curves[0].name == "elbow_flex"


def test_curves_are_those_of_the_evidence_and_break_between_trajectories() -> None:
    found = example("named")
    overlay = overlay_of("friday", PR2, found.verdict, found.evidence)
    assert set(overlay.arms) == {"measured", "base_fit", "extended"}
    curves = next(each for each in overlay.curves if each.name == JOINTS[0])
    first = found.evidence.held_out[0]
    count = len(first.at)
    expected = 1e3 * (first.q[:, 0] - first.predicted["extended"][:, 0])
    np.testing.assert_allclose(curves.residual["extended"][:count], expected)
    assert np.isnan(curves.residual["extended"][count])
    assert (np.diff(curves.at) > 0).all()
    tracker = overlay.curves[-1]
    assert (tracker.name, tracker.units[1]) == ("tracker", "mm")


def test_a_simulation_that_diverged_stops_where_it_was() -> None:
    found = example("none")
    for replay in found.evidence.replays:
        replay.predicted["base_fit"][300:] = np.nan
    overlay = overlay_of("friday", PR2, found.verdict, found.evidence)
    assert np.isfinite(overlay.arms["base_fit"].positions).all()


def test_the_recording_is_written_whole_or_not_at_all(tmp_path: Path) -> None:
    found = example("unexplained")
    overlay = overlay_of("friday", PR2, found.verdict, found.evidence)
    path = tmp_path / "recording.rrd"
    write_overlay_recording(path, overlay)
    assert trim(path) == 0
    content = path.read_bytes()
    for entity in ("/arms/measured/poses", "/arms/base_fit/poses", "/residual/elbow_flex"):
        assert entity.encode() in content
    assert [each.name for each in tmp_path.iterdir()] == ["recording.rrd"]
    with pytest.raises(RiposteError, match="cannot be written"):
        write_overlay_recording(tmp_path / "nowhere" / "recording.rrd", overlay)


def test_a_hostile_name_is_one_part_of_a_path() -> None:
    assert path_of("residual", "a/b ../c").count("/") == 1 + path_of("residual", "a/b ../c").count(
        r"\/"
    )
