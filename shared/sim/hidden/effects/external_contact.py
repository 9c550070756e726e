"""Somebody pushed once: a torque at one joint within one recording."""

from shared.sim.hidden.effect import IN, Case, Hidden, Scene, dof_of, sign
from shared.sim.hidden.robot import Law, Moment, Robot


def _places(scene: Scene) -> tuple[str, ...]:
    return tuple(
        f"{joint}{IN}{trajectory}" for trajectory in scene.trajectories for joint in scene.joints
    )


def _joint(place: str) -> str:
    return place.split(IN, 1)[0]


def _torque(case: Case) -> float:
    return sign(float(case.shape[0])) * case.size


def _begin(case: Case) -> float:
    return (0.15 + 0.55 * float(case.shape[1])) * case.scene.duration


def _length(case: Case) -> float:
    return 0.15 + 0.5 * float(case.shape[2])


def _enter(robot: Robot, case: Case) -> None:
    robot.laws.append(lambda: _push(robot, case))


def _push(robot: Robot, case: Case) -> Law:
    trajectory = case.place.split(IN, 1)[1]
    begin, end = _begin(case), _begin(case) + _length(case)

    def act(moment: Moment) -> None:
        if moment.trajectory == trajectory and begin <= moment.time < end:
            dof = dof_of(robot, moment.model, _joint(case.place))
            moment.data.qfrc_applied[dof] += _torque(case)

    return act


HIDDEN = Hidden(
    name="external_contact",
    way="a torque at whole steps",
    places=_places,
    sizes=lambda scene, place: (5e-3 * scene.torque(_joint(place)), scene.torque(_joint(place))),
    values=lambda case: {
        "torque": (_torque(case), "N m"),
        "begin": (_begin(case), "s"),
        "length": (_length(case), "s"),
    },
    enter=_enter,
)
