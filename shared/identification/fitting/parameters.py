"""The parameters that are fitted before any cause is looked for, and what is known of them.

The paper fits damping, armature, friction loss and the controller's gains. Here every joint and
every axis has its own, and the links' inertia may move too, held by what is known of it: a base
that is too coarse blames effects for what is its own fault.

Coordinates are normalised: 0 is nominal, and 1 is a factor e or the scale of a sum.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from shared.identification.arm.places import Place, place_of
from shared.identification.arm.subject import Subject
from shared.identification.dataset.types import Float64
from shared.sim.plant.kinematics import turned_axes
from shared.sim.plant.row import Row, drives_of

INERTIA_PRIOR = 0.1
"""Standard deviation of what is known of a link's mass and inertia (1), and, in units of
``_CENTRE``, of where its centre of mass is: 5 mm, cables and screws."""
_CENTRE = 0.05
"""(m)."""
LOOSE = 1.5
"""Of damping, armature and gains: a factor of 4.5 either way is unlikely."""
_FAR = 4.0
"""How far any of them may be, up or down: of what is a 400th of itself, a step shows nothing."""
_MOST_FRICTION = 30.0
"""Beyond what the model file says, in units of it: small servos rub with ten times that."""
_LEAST_FRICTION = 0.01
"""Of what drives a joint: some model files have a stand-in for its friction."""


@dataclass(frozen=True)
class BaseParameter:
    """One number of the base model."""

    name: str
    """``damping shoulder_pan``."""
    unit: str
    nominal: float
    is_factor: bool
    """Whether the value is nominal * exp(x), else nominal + scale * x."""
    scale: float
    low: float
    """Of x."""
    high: float
    prior: float
    """Standard deviation of what is known of x beforehand."""
    change: Callable[[Row, float], None]
    """Puts a value (not x) into one arm."""

    def value(self, x: float) -> float:
        """Return the value at a coordinate."""
        return self.nominal * float(np.exp(x)) if self.is_factor else self.nominal + self.scale * x


def base_parameters(subject: Subject) -> tuple[BaseParameter, ...]:
    """Return the parameters of a subject; what its model has not (no friction) is none."""
    found: list[BaseParameter] = []
    model = subject.nominal.model
    for joint, label in enumerate(subject.joints):
        place = place_of(subject, label)
        for field, word, unit in (
            ("dof_damping", "damping", "N m s/rad"),
            ("dof_armature", "armature", "kg m^2"),
        ):
            nominal = float(getattr(model, field)[place.dof])
            if nominal > 0.0:
                change = _setter(field, joint)
                most = _most(place, nominal) if word == "armature" else _FAR
                found.append(_factor(f"{word} {label}", unit, nominal, LOOSE, change, most))
        if (friction := _friction_scale(subject, place)) > 0.0:
            nominal = float(model.dof_frictionloss[place.dof])
            found.append(
                BaseParameter(
                    name=f"friction_loss {label}",
                    unit="N m",
                    nominal=nominal,
                    is_factor=False,
                    scale=friction,
                    low=-nominal / friction,
                    high=max(_MOST_FRICTION, place.drive / friction) if nominal > 0.0 else 5.0,
                    prior=LOOSE,
                    change=_setter("dof_frictionloss", joint),
                )
            )
    found += _gains(subject)
    found += _inertias(subject)
    return tuple(found)


def loose_parameters(
    subject: Subject, parameters: tuple[BaseParameter, ...]
) -> tuple[BaseParameter, ...]:
    """Return what else is known of links but not to the last digit, and is not fitted.

    How hard each is to turn, by itself, and where its centre of mass is.

    Args:
        subject: the arm.
        parameters: what is fitted.
    """
    model = subject.nominal.model
    fitted = {each.name for each in parameters}
    found: list[BaseParameter] = []
    for label, body in _links(subject):
        nominal = float(model.body_inertia[body].max())
        found.append(_link_factor(f"inertia {label}", "kg m^2", nominal, _inertia_setter(body)))
        found += [each for each in _centres(subject, label, body) if each.name not in fitted]
    return tuple(found)


def bends(parameters: tuple[BaseParameter, ...], x: Float64) -> Float64:
    """Return float64[n], how many standard deviations from what is known of its link each is.

    Args:
        parameters: of a base; of what is no link's it is 0.
        x: their coordinates, float64[n or more].
    """
    return np.array(
        [
            coordinate / each.prior if each.prior == INERTIA_PRIOR else 0.0
            for each, coordinate in zip(parameters, x, strict=False)
        ]
    )


def enter_base(parameters: tuple[BaseParameter, ...], x: Float64, row: Row) -> None:
    """Put the base model at coordinates into one arm: float64[n]."""
    for parameter, coordinate in zip(parameters, x, strict=True):
        if coordinate != 0.0:
            parameter.change(row, parameter.value(float(coordinate)))


def _factor(
    name: str,
    unit: str,
    nominal: float,
    prior: float,
    change: Callable[[Row, float], None],
    most: float = _FAR,
) -> BaseParameter:
    return BaseParameter(name, unit, nominal, True, 1.0, -_FAR, most, prior, change)


def _most(place: Place, nominal: float) -> float:
    """Return how far up an armature may be: what all of the drive could just accelerate.

    Model files of geared arms often have a stand-in for it, a hundredth of what the arm has.
    """
    return max(_FAR, math.log(place.drive / place.acceleration / nominal))


def _setter(field: str, joint: int) -> Callable[[Row, float], None]:
    """Return what sets a field of a logged joint, wherever added joints have moved it."""

    def change(row: Row, value: float) -> None:
        row.field(field)[row.dofs[joint]] = value

    return change


def _friction_scale(subject: Subject, place: Place) -> float:
    """Return how much friction is a unit; 0 where the model has none and it is to be found.

    A PR2's joints are known to rub, the model only does not know how much; of another arm a
    friction that its model lacks is a cause to be named.
    """
    model = subject.nominal.model
    nominal = float(model.dof_frictionloss[place.dof])
    if subject.control != "pose":
        least = _LEAST_FRICTION * place.drive
        return max(nominal, least) if nominal > 0.0 else 0.0
    if nominal > 0.0:
        return nominal
    return 0.05 * float(model.jnt_actfrcrange[place.joint, 1])


def _gains(subject: Subject) -> list[BaseParameter]:
    """Return the gains of servos: kp and kv are in gain and bias of the same actuator."""
    model = subject.nominal.model
    found: list[BaseParameter] = []
    if subject.control == "torque":
        return found
    for name in subject.plant.actuators:
        actuator = int(model.actuator(name).id)
        label = _driven(subject, actuator) or name.rsplit("/", 1)[-1]
        kp, kv = (
            float(model.actuator_gainprm[actuator, 0]),
            -float(model.actuator_biasprm[actuator, 2]),
        )
        for word, nominal, change in (
            ("kp", kp, _kp_setter(actuator)),
            ("kv", kv, _kv_setter(actuator)),
        ):
            if nominal > 0.0:
                found.append(_factor(f"{word} {label}", "", nominal, LOOSE, change))
    return found


def _driven(subject: Subject, actuator: int) -> str:
    """Return the joint that an actuator acts on alone; empty if there is none."""
    plant, model = subject.plant, subject.nominal.model
    drives = {label: drives_of(plant, model, label) for label in subject.joints}
    return next((label for label, own in drives.items() if actuator in own), "")


def _kp_setter(actuator: int) -> Callable[[Row, float], None]:
    def change(row: Row, value: float) -> None:
        row.field("actuator_gainprm")[actuator, 0] = value
        row.field("actuator_biasprm")[actuator, 1] = -value

    return change


def _kv_setter(actuator: int) -> Callable[[Row, float], None]:
    def change(row: Row, value: float) -> None:
        row.field("actuator_biasprm")[actuator, 2] = -value

    return change


def _inertias(subject: Subject) -> list[BaseParameter]:
    """Return a factor of mass and inertia for each link that moves, however many joints it has.

    And its centre of mass, but only where motors do not hold the arm to a command: elsewhere it is
    lost in what they hold.
    """
    model = subject.nominal.model
    found: list[BaseParameter] = []
    for label, body in _links(subject):
        nominal = float(model.body_mass[body])
        found.append(_link_factor(f"mass {label}", "kg", nominal, _mass_setter(body)))
        if subject.control == "torque":
            found += _centres(subject, label, body)
    return found


def _links(subject: Subject) -> list[tuple[str, int]]:
    """Return the joint and the body of each link that moves and weighs something."""
    model = subject.nominal.model
    found: dict[int, str] = {}
    for label in subject.joints:
        joint = int(model.joint(subject.plant.mj_joint(label)).id)
        body = int(model.jnt_bodyid[joint])
        if model.body_mass[body] > 0.0:
            found.setdefault(body, label)
    return [(label, body) for body, label in found.items()]


def _link_factor(
    name: str, unit: str, nominal: float, change: Callable[[Row, float], None]
) -> BaseParameter:
    return BaseParameter(name, unit, nominal, True, 1.0, -1.0, 1.0, INERTIA_PRIOR, change)


def _centres(subject: Subject, label: str, body: int) -> list[BaseParameter]:
    """Return where the centre of mass of a link is, along its body's axes.

    Along an axis that every hinge before it turns about it is not felt.
    """
    model = subject.nominal.model
    is_turned = turned_axes(model, body)
    return [
        BaseParameter(
            name=f"centre_{word} {label}",
            unit="m",
            nominal=float(model.body_ipos[body, index]),
            is_factor=False,
            scale=_CENTRE,
            low=-1.0,
            high=1.0,
            prior=INERTIA_PRIOR,
            change=_centre_setter(body, index),
        )
        for index, word in enumerate("xyz")
        if is_turned[index]
    ]


def _centre_setter(body: int, index: int) -> Callable[[Row, float], None]:
    def change(row: Row, value: float) -> None:
        row.field("body_ipos")[body, index] = value

    return change


def _inertia_setter(body: int) -> Callable[[Row, float], None]:
    def change(row: Row, value: float) -> None:
        inertia = row.field("body_inertia")[body]
        inertia *= value / inertia.max()

    return change


def _mass_setter(body: int) -> Callable[[Row, float], None]:
    def change(row: Row, value: float) -> None:
        mass = row.field("body_mass")
        row.field("body_inertia")[body] *= value / mass[body]
        mass[body] = value

    return change
