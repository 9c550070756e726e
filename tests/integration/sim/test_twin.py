"""The twin: training's physics, the robot's controller in front of it."""

import numpy as np
import pytest

from shared.sim.batch import FencingBatch
from shared.sim.config import SimConfig
from shared.sim.model import FencingModel
from shared.sim.twin import Twin, command_of

DIRECT = command_of(1.0, 0.0)
AS_SHIPPED = command_of(0.01, 0.0075)


@pytest.fixture(scope="module")
def model() -> FencingModel:
    return FencingModel.build(SimConfig())


def test_with_a_direct_command_it_is_the_world_of_training_bit_for_bit(model: FencingModel):
    batch, twin = FencingBatch(model, 1), Twin(model, DIRECT, 1e9, person=False)
    draw = np.random.default_rng(0)
    for _ in range(200):
        command = twin.tools()
        command[:, :3] += draw.uniform(-0.03, 0.03, (2, 3))
        batch.ctrl[0] = command.ravel()
        for side in (0, 1):
            twin.command(side, command[side])
        batch.step()
        twin.step()
        for side in (0, 1):
            assert np.array_equal(twin.bat(side), batch.sensors[0, 20 * side : 20 * side + 13])


def test_the_controller_as_shipped_lags_a_tenth_of_a_second_behind(model: FencingModel):
    moved: dict[str, float] = {}
    for name, command in (("direct", DIRECT), ("as shipped", AS_SHIPPED)):
        twin = Twin(model, command, 30.0, person=True)
        target = twin.tools()[1]
        start = target[2]
        target[2] += 0.03
        twin.command(1, target)
        for _ in range(10):
            twin.step()
        moved[name] = twin.tools()[1, 2] - start
    assert 0.0 < moved["as shipped"] < 0.6 * moved["direct"]


@pytest.mark.parametrize("newtons", [15.0, 30.0])
def test_the_static_force_is_what_the_velocity_saturation_allows(
    model: FencingModel, newtons: float
):
    twin = Twin(model, AS_SHIPPED, newtons, person=True)
    far = twin.tools()[1]
    far[0] += 5.0  # out of reach: the arm ends stretched, pushing
    twin.command(1, far)
    for _ in range(1500):
        twin.step()
    assert twin.force(1) == pytest.approx(newtons, rel=0.05)


def test_a_bat_of_a_person_stops_the_robots(model: FencingModel):
    heights: list[float] = []
    for is_there in (True, False):
        twin = Twin(model, AS_SHIPPED, 15.0, person=True)
        x, y, z = twin.bat(1)[:3]
        across = np.array([x, y + 0.5, z + (0.3 if is_there else 2.0), 0.0, 0.0, 0.0, 0.0])
        across[3:] = np.array([1.0, 0.0, 0.0, -1.0]) / np.sqrt(2)  # along -y, over the blade
        twin.place_person(np.concatenate([across, np.zeros(6)]))
        up = twin.tools()[1]
        up[2] += 0.3
        for _ in range(300):
            twin.command(1, up)
            twin.step()
        heights.append(float(twin.bat(1)[2] - z))
    assert np.isfinite(heights).all()
    assert abs(heights[0] - heights[1]) > 0.01


def test_a_latched_controller_stays_where_it_is(model: FencingModel):
    twin = Twin(model, AS_SHIPPED, 15.0, person=True)
    target = twin.tools()[1]
    target[2] += 0.3
    twin.command(1, target)
    for _ in range(30):
        twin.step()
    twin.latch()
    at = twin.tools()[1, :3]
    for _ in range(400):  # the joints' damping lets it come back slowly
        twin.step()
        assert np.linalg.norm(twin.tools()[1, :3] - at) < 0.06
    settled = twin.tools()[1, :3]
    for _ in range(100):
        twin.step()
    assert np.linalg.norm(twin.tools()[1, :3] - settled) < 1e-3
