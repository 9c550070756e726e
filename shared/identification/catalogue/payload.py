"""The tool carries more, or less, than the model says."""

import functools
from typing import Final

import numpy as np

from shared.identification.arm.subject import Subject
from shared.identification.dataset.types import Float64
from shared.identification.effect import Quantity, Side
from shared.sim.plant.inertia import add_inertia
from shared.sim.plant.kinematics import turned_axes
from shared.sim.plant.plant import Plant, is_weightless
from shared.sim.plant.row import Row
from shared.sim.plant.structure import Structure, compiled

_GRAVITY = 9.81
"""m/s^2."""
OFF_CENTRE: Final = "tool off its centre"
_REACH = 0.5
"""About as far beside the tool's centre as something held may be (m)."""


class Payload:
    """A mass like the tool at its centre, or one beside it, which then moves that.

    What is beside it may be of any size: how hard that is to turn by itself is a number of its own.
    """

    name = "payload"
    title = "the tool is heavier than the model says"
    signature = "Inertia and weight grow together, more the further out a joint carries them."
    side: Side = "plant"

    def places(self, subject: Subject) -> tuple[str, ...]:
        """Return the whole arm: the tool is where it is; and beside its centre, if that is felt.

        Where the controller carries the tool's weight, it does so where the centre is by then.
        """
        return ("", OFF_CENTRE) if _hangs(subject) and _axes(subject) else ("",)

    def quantities(self, subject: Subject, place: str) -> tuple[Quantity, ...]:
        """Return the mass that the model lacks; beside the centre how it moves that, and turns."""
        mass = Quantity("mass", "kg", 0.0, 10.0, probe=0.3)
        if place != OFF_CENTRE:
            return (mass,)
        moved = (Quantity(f"centre_{axis}", "m", -0.2, 0.2, probe=0.01) for axis in _axes(subject))
        return (mass, *moved, Quantity("inertia", "kg m^2", 0.0, 0.5, probe=1e-3))

    def structure(self, subject: Subject, place: str) -> Structure:
        """Return nothing: the body is there."""
        return ()

    def enter(self, row: Row, place: str, values: Float64) -> None:
        """Make the tool's body heavier, its radius of gyration unchanged.

        The springs of a counterbalanced arm, or a controller that carries its weight, do not know
        of it: there it pulls by itself. Beside the centre it is a body of its own (Steiner).
        """
        body, added = row.tool_body(), float(values[0])
        mass = row.field("body_mass")
        own = float(mass[body])
        if is_weightless(row.model):
            row.forces[body] = (0.0, 0.0, -_GRAVITY * added)
        grown = (mass[body] + added) / mass[body]
        mass[body] *= grown
        if row.model.body_gravcomp[body]:
            row.field("body_gravcomp")[body] /= grown
        if place != OFF_CENTRE:
            row.field("body_inertia")[body] *= grown
            return
        moved = np.zeros(3)
        moved[np.array(_turned(row.plant))] = values[1:-1]
        row.field("body_ipos")[body] += moved
        add_inertia(row, body, _apart(own, added, moved) + float(values[-1]) * np.eye(3))


def _apart(own: float, added: float, moved: Float64) -> Float64:
    """Return float64[3, 3], what two masses are harder to turn for being apart (kg m^2).

    As they come together by Steiner's theorem, about the centre of both. No mass beside the centre
    would have to be infinitely far off to move it, so further off than can be it is less.

    Args:
        own: the tool's (kg).
        added: what it carries (kg).
        moved: float64[3], from its centre to that of both (m).
    """
    both = own + added
    square = float(moved @ moved)
    least = added**4 + square**2 * (both / _REACH) ** 4
    if not least:
        return np.zeros((3, 3))
    return own * both * added**3 / least * (square * np.eye(3) - np.outer(moved, moved))


def _hangs(subject: Subject) -> bool:
    """Return whether the tool's weight is the joints' to carry."""
    model = subject.nominal.model
    tool = int(model.body(subject.plant.tool_body).id)
    return subject.has_gravity and not model.body_gravcomp[tool]


def _axes(subject: Subject) -> str:
    """Return along which axes of the tool's body its joints feel where it is heavy."""
    turned = _turned(subject.plant)
    return "".join(axis for axis, is_turned in zip("xyz", turned, strict=True) if is_turned)


@functools.lru_cache(maxsize=8)
def _turned(plant: Plant) -> tuple[bool, ...]:
    """Return the same for x, y and z, whatever is added to the arm; every simulated one asks."""
    model = compiled(plant, ())
    return tuple(turned_axes(model, int(model.body(plant.tool_body).id)))


EFFECT = Payload()
