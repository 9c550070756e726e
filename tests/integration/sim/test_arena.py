import msgspec
import mujoco
import numpy as np

from shared.sim.build import ARENA_BYTES
from shared.sim.config import SimConfig
from shared.sim.model import FencingModel
from shared.sim.parameters import JOINT_NAMES, load_parameters


def test_the_scratch_memory_is_twice_what_the_worst_entanglement_needs():
    nominal = load_parameters("nominal")
    rough = {
        name: msgspec.structs.replace(nominal.joints[name], friction_loss=0.5)
        for name in JOINT_NAMES
    }
    parameters = msgspec.structs.replace(
        nominal, joints=msgspec.structs.replace(nominal.joints, **rough)
    )
    # Close enough to reach everything of each other, joints beyond their limits.
    cfg = SimConfig(bat_arm_contacts=True, half_distance=0.6)
    model = FencingModel.of(cfg, parameters)
    rng = np.random.default_rng(0)
    low, high = model.mj.jnt_range.T.copy()
    free = ~model.mj.jnt_limited.astype(bool)
    low[free], high[free] = -np.pi, np.pi
    data = mujoco.MjData(model.mj)
    contacts = 0
    for _ in range(5000):
        data.qpos[:] = rng.uniform(low - 0.3, high + 0.3)
        mujoco.mj_forward(model.mj, data)
        contacts = max(contacts, data.ncon)
    assert contacts >= 3
    assert 2 * data.maxuse_arena < ARENA_BYTES
