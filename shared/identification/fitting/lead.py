"""Joints that are ahead of their commands.

The physics here is of second order: what drives an arm acts from half a step before an instant to
half a step after it. A simulation that writes the command and makes a plain MuJoCo step is early by
half of its step, and so is one that logs a reading beside the command that came after it. Nor does
every log stamp a command when it is sent. No arm moves before it is told to, so nothing of it is to
blame: a base that could not be early would bend its gains and inertia towards it, and see a cause
in what is left.
"""

from shared.identification.arm.subject import Subject
from shared.identification.fitting.fit import Fit
from shared.identification.fitting.parameters import LOOSE, BaseParameter
from shared.sim.plant.row import Row

_NAME = "command_lead"
_MOST = 0.02
"""Beyond what a log may be off by (s)."""


def lead_of(subject: Subject) -> tuple[BaseParameter, ...]:
    """Return by how much joints are ahead, alike for all of them; none of a pose's controller."""
    if subject.control == "pose":
        return ()
    half = 0.5 * subject.plant.timestep

    def change(row: Row, value: float) -> None:
        row.command = row.command.later(-value)

    most = max(2.0, _MOST / half)
    return (BaseParameter(_NAME, "s", 0.0, False, half, 0.0, most, LOOSE, change),)


def ahead_of_commands(fit: Fit) -> str:
    """Return in words that a fit has joints ahead of their commands; empty if it has not."""
    values = (
        each.value(float(z))
        for each, z in zip(fit.space.problem.parameters, fit.z, strict=False)
        if each.name == _NAME
    )
    lead = next(values, 0.0)
    if not lead:
        return ""
    return (
        f"joints are {1e3 * lead:.2g} ms ahead of their commands, as no arm is: the log stamps "
        "commands late, or a simulation made it that steps with each command. The base makes up "
        "for it"
    )
