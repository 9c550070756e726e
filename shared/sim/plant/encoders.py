"""A joint whose encoder is not right: the log and the controller believe what it says."""

from shared.sim.plant.row import JointsReport, Row
from shared.sim.plant.signals import Signal


def misread(row: Row, label: str, scale: float, offset: float) -> None:
    """Let the encoder of a joint say ``scale * q + offset`` where the joint is at q.

    A servo at the joint holds what the encoder says to its command. A controller of poses takes
    its kinematics of the encoders.

    Args:
        row: the arm.
        label: the logged joint.
        scale: 1 is right.
        offset: 0 is right (rad, m).
    """
    joint = row.plant.labels.index(label)
    row.initial_q = row.initial_q.copy()
    row.initial_q[joint] = (row.initial_q[joint] - offset) / scale
    row.initial_qd = row.initial_qd.copy()
    row.initial_qd[joint] /= scale

    def report(joints: JointsReport) -> None:
        joints.q[:, joint] = scale * joints.q[:, joint] + offset

    row.on_joints(report)
    for actuator in row.drives_of(label):
        bias = row.field("actuator_biasprm")[actuator]
        bias[0] += bias[1] * row.model.actuator_gear[actuator, 0] * offset
        bias[1:3] *= scale
    if row.plant.control != "pose":
        return
    at, values = row.logged_q.at, row.logged_q.values.copy()
    values[:, joint] = (values[:, joint] - offset) / scale
    row.logged_q = Signal(at, values)
    row.misread(joint, scale, offset)
