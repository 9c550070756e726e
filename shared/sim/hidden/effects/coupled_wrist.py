"""The motors of the wrist's differential rub: as bristles on sum and difference."""

from shared.sim.hidden.bristles import Bristles
from shared.sim.hidden.effect import Case, Hidden, Scene, dof_of
from shared.sim.hidden.robot import Law, Moment, Robot


def _places(scene: Scene) -> tuple[str, ...]:
    return (scene.joints[-1],) if len(scene.joints) > 2 else ()


def _levels(case: Case) -> tuple[float, float]:
    """Return the friction of the motor that turns with the sum, and of the other (N m)."""
    share = 0.1 + 0.8 * float(case.shape[0])
    most = max(share, 1.0 - share)
    return case.size * share / most, case.size * (1.0 - share) / most


def _sizes(scene: Scene, place: str) -> tuple[float, float]:
    return 2e-3 * scene.torque(place), 0.15 * scene.torque(place)


def _enter(robot: Robot, case: Case) -> None:
    robot.laws.append(lambda: _rub(robot, case))


def _rub(robot: Robot, case: Case) -> Law:
    of_sum, of_difference = Bristles(), Bristles()
    level_sum, level_difference = _levels(case)
    before = case.scene.joints[case.scene.joints.index(case.place) - 1]

    def act(moment: Moment) -> None:
        first, last = (dof_of(robot, moment.model, label) for label in (before, case.place))
        speeds = moment.data.qvel
        plus = of_sum.torque(level_sum, float(speeds[first] + speeds[last]), moment.timestep)
        minus = of_difference.torque(
            level_difference, float(speeds[first] - speeds[last]), moment.timestep
        )
        moment.data.qfrc_applied[first] += plus + minus
        moment.data.qfrc_applied[last] += plus - minus

    return act


HIDDEN = Hidden(
    name="coupled_wrist",
    way="bristles, not tendons that rub",
    places=_places,
    sizes=_sizes,
    values=lambda case: {
        "of_sum": (_levels(case)[0], "N m"),
        "of_difference": (_levels(case)[1], "N m"),
    },
    enter=_enter,
)
