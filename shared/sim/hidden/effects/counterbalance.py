"""Something carries a part of the weight on a joint; on a PR2, its adjusters were turned.

The PR2's torques are what Willow Garage measured on a real arm (pr2_self_test at 886d78c,
counterbalance_model.dat, BSD), with ripples of the size by which single readings of that table
scatter.
"""

import numpy as np

from shared.sim.arm import Float64
from shared.sim.hidden.effect import Case, Hidden, Scene, Values, dof_of, sign
from shared.sim.hidden.robot import Law, Moment, Robot

_LIFT, _FLEX = "shoulder_lift", "elbow_flex"
_TURN = np.array(
    [
        [[0.2535, 0.0210, 0.0571, 0.0086], [1.1186, -0.0469, -0.0870, -0.0193]],
        [[-0.0011, 0.0033, 0.0661, 0.0015], [0.0109, 0.0108, -0.0281, -0.0207]],
    ]
)
"""float64[joint, adjuster, 4] (N m a turn) of cos and sin of lift, then of lift + flex."""
_SCATTER = np.array([[0.011, 0.043], [0.004, 0.018]])
"""float64[joint, adjuster] (N m a turn), root mean square."""


def _places(scene: Scene) -> tuple[str, ...]:
    """Return a PR2's whole arm; else the joints that carry weight."""
    return {"pr2": ("",), "arm3": ("shoulder", "elbow"), "torque2": ("shoulder", "elbow")}[
        scene.arm.name
    ]


def _sizes(scene: Scene, place: str) -> tuple[float, float]:
    return (2e-3, 0.4) if place else (0.02, 5.0)


def _turns(case: Case) -> Float64:
    """Return float64[2], turns of spring and bar; the spring's do a quarter as much."""
    angle = 2.0 * np.pi * float(case.shape[1])
    return case.size * np.array([2.5 * np.cos(angle), np.sin(angle)])


def _share(case: Case) -> float:
    return sign(float(case.shape[0])) * case.size


def _values(case: Case) -> Values:
    if case.place:
        return {"share": (_share(case), "1")}
    spring, bar = _turns(case).tolist()
    return {"spring": (spring, "turns"), "bar": (bar, "turns")}


def _enter(robot: Robot, case: Case) -> None:
    robot.laws.append(lambda: _carry(robot, case) if case.place else _screws(robot, case))


def _carry(robot: Robot, case: Case) -> Law:
    share = _share(case)

    def act(moment: Moment) -> None:
        model, data = moment.model, moment.data
        joint = model.joint(robot.plant.mj_joint(case.place))
        body = int(model.jnt_bodyid[joint.id])
        weight = float(model.body_subtreemass[body]) * np.array(model.opt.gravity)
        lever = data.subtree_com[body] - data.xanchor[joint.id]
        torque = float(data.xaxis[joint.id] @ np.cross(lever, weight))
        data.qfrc_applied[dof_of(robot, model, case.place)] -= share * torque

    return act


def _screws(robot: Robot, case: Case) -> Law:
    turns = _turns(case)

    def act(moment: Moment) -> None:
        model, data = moment.model, moment.data
        dofs = [dof_of(robot, model, label) for label in (_LIFT, _FLEX)]
        lift, flex = (float(data.qpos[dof]) for dof in dofs)
        both = lift + flex
        shape = np.array([np.cos(lift), np.sin(lift), np.cos(both), np.sin(both)])
        ripple = np.sqrt(2.0) * _SCATTER * np.sin(5.0 * lift + 4.0 * flex)
        data.qfrc_applied[dofs] -= (_TURN @ shape + ripple) @ turns

    return act


HIDDEN = Hidden(
    name="counterbalance",
    way="the moment of the weight by its lever; of a PR2 with what its fit leaves over",
    places=_places,
    sizes=_sizes,
    values=_values,
    enter=_enter,
)
