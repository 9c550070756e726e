import zlib

import msgspec
import numpy as np
import pytest

from shared.sim.config import SimConfig
from shared.sim.model import FencingModel
from shared.sim.parameters import ModelParameters, ResidualSpring, load_parameters
from shared.sim.render import encode_png

CFG = SimConfig()
MODEL = FencingModel.build(CFG)


def leaves(value: object, path: tuple[str, ...] = ()) -> list[tuple[str, ...]]:
    if isinstance(value, dict):
        return [leaf for key, item in value.items() for leaf in leaves(item, (*path, key))]
    if isinstance(value, list):
        return [leaf for key, item in enumerate(value) for leaf in leaves(item, (*path, str(key)))]
    return [path] if isinstance(value, float) else []


PARAMETERS = leaves(msgspec.json.decode(msgspec.json.encode(load_parameters("nominal"))))


@pytest.mark.parametrize("path", PARAMETERS, ids=".".join)
def test_the_hash_changes_with_every_parameter(path: tuple[str, ...]):
    tree = msgspec.json.decode(msgspec.json.encode(load_parameters("nominal")))
    node = tree
    for key in path[:-1]:
        node = node[int(key)] if isinstance(node, list) else node[key]
    last = int(path[-1]) if isinstance(node, list) else path[-1]
    node[last] += -1e-9 if path[-1] == "filter" else 1e-9
    assert FencingModel.of(CFG, msgspec.convert(tree, ModelParameters)).hash != MODEL.hash


def test_the_hash_changes_with_the_scene_and_with_an_extension():
    nominal = load_parameters("nominal")
    spring = ResidualSpring(joint="elbow_flex", stiffness=1.0, angle=-1.0)
    others = [
        FencingModel.of(CFG, msgspec.structs.replace(nominal, extensions=(spring,))),
        *(
            FencingModel.build(cfg)
            for cfg in (
                SimConfig(physics_timestep=0.005),
                SimConfig(control_timestep=0.02),
                SimConfig(target_radius=0.21),
                SimConfig(arms=("left", "right")),
                SimConfig(bat_arm_contacts=True),
            )
        ),
    ]
    assert len({MODEL.hash, *(other.hash for other in others)}) == 1 + len(others)


def test_the_hash_ignores_what_the_model_is_called():
    renamed = msgspec.structs.replace(load_parameters("nominal"), name="another")
    assert FencingModel.of(CFG, renamed).hash == MODEL.hash == FencingModel.build(CFG).hash


def test_the_physics_holds_only_the_two_bats_and_two_times_seven_hinges():
    assert MODEL.mj.ngeom == 2
    assert MODEL.mj.npair == 1
    assert (MODEL.mj.nv, MODEL.mj.nu, MODEL.mj.nsensordata) == (14, 14, 40)


def test_looks_neither_move_nor_weigh_nor_touch():
    scene = MODEL.scene
    assert (scene.nbody, scene.nq, scene.npair) == (MODEL.mj.nbody, 14, 1)
    assert scene.body_mass.sum() == pytest.approx(MODEL.mj.body_mass.sum())
    assert not scene.geom_contype.any()
    assert not scene.geom_conaffinity.any()


def test_the_shapes_are_enough_to_draw_the_scene():
    assert MODEL.body_names[0] == "world"
    assert len(MODEL.body_names) == MODEL.mj.nbody
    by_name = {shape.name: shape for shape in MODEL.shapes}
    assert by_name["look/target"].position == tuple(MODEL.target_centre)
    bat = by_name["protagonist/bat"]
    assert MODEL.body_names[bat.body] == "protagonist/wrist_roll"
    assert bat.size == pytest.approx((0.025, 0.375))
    assert all(np.isfinite([*shape.size, *shape.position]).all() for shape in MODEL.shapes)


def test_the_robots_face_each_other_across_the_target():
    antagonist, protagonist = MODEL.base_position
    assert (antagonist + protagonist) / 2 == pytest.approx([0.0, 0.0, 0.990675])
    assert antagonist[0] == 1.0
    assert MODEL.base_yaw == (np.pi, 0.0)


def test_a_picture_file_holds_its_pixels():
    pixels = np.random.default_rng(0).integers(0, 256, (3, 5, 3), np.uint8)
    data = encode_png(pixels)
    assert data.startswith(b"\x89PNG\r\n\x1a\n")
    start = data.index(b"IDAT") + 4
    length = int.from_bytes(data[start - 8 : start - 4], "big")
    rows = np.frombuffer(zlib.decompress(data[start : start + length]), np.uint8).reshape(3, 16)
    assert (rows[:, 0] == 1).all()
    decoded = np.cumsum(rows[:, 1:].reshape(3, 5, 3), axis=1, dtype=np.uint8)
    assert (decoded == pixels).all()
