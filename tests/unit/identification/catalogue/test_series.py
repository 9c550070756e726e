from dataclasses import replace

import numpy as np

from shared.identification.catalogue import joint_elasticity
from shared.sim.plant.kinematics import tool_poses
from shared.sim.plant.plant import pr2
from shared.sim.plant.signals import Signal
from tests.arms import make_subject, recorded, replay

EN_GARDE = (-0.971, 0.231, -1.6, -1.607, 0.513, -0.961, 1.46)


def test_a_link_that_hardly_gives_is_hardly_seen_by_a_pose_controller():
    """However little the link is off its motor, nothing of the log's smoothing may be left."""
    subject = make_subject(pr2("right", None))
    home = np.array(EN_GARDE)

    def way(at: np.ndarray) -> np.ndarray:
        q = home + 0.1 * np.sin(9.0 * at)[:, None] * np.ones(7)
        return tool_poses(subject.plant, subject.nominal.model, q)

    command = recorded(way, 1.0, EN_GARDE)
    plain = replay(subject, command)
    moving = replace(command, logged_q=Signal(command.joints_at, plain.q))
    found = replay(subject, moving, joint_elasticity.EFFECT, "elbow_flex", [1e-9])
    np.testing.assert_allclose(found.q, plain.q, atol=2e-6)
