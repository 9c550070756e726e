"""A link is heavier or lighter than the model says, far beyond what is known of it."""

import numpy as np

from shared.identification.arm.places import moving
from shared.identification.arm.subject import Subject
from shared.identification.dataset.types import Float64
from shared.identification.effect import Quantity, Side
from shared.sim.plant.row import Row
from shared.sim.plant.structure import Structure

_LAST = 3
"""Of so many links at the end; those before carry them, and cannot be told from armature."""


class InertiaError:
    """Mass and inertia of a link by the same share; of the tool's link ``payload`` is that."""

    name = "inertia_error"
    title = "a link is heavier or lighter than the model says"
    signature = "Weight and inertia of one link are off together, felt by the joints before it."
    side: Side = "plant"

    def places(self, subject: Subject) -> tuple[str, ...]:
        """Return the last links that move and have a mass, the tool's left out."""
        model = subject.nominal.model
        tool = model.body_weldid[model.body(subject.plant.tool_body).id]
        last = subject.joints[-_LAST:]
        return tuple(
            place.label
            for place in moving(subject)
            if place.label in last
            and (body := model.body_weldid[model.jnt_bodyid[place.joint]]) != tool
            and model.body_mass[body] > 0.0
        )

    def quantities(self, subject: Subject, place: str) -> tuple[Quantity, ...]:
        """Return the share of the mass that the model lacks."""
        return (Quantity("share", "1", -0.7, 2.0, probe=0.3),)

    def structure(self, subject: Subject, place: str) -> Structure:
        """Return nothing: the link is there."""
        return ()

    def enter(self, row: Row, place: str, values: Float64) -> None:
        """Scale all bodies of the link; a controller that carries its weight goes by the model."""
        if not values[0]:
            return
        link = np.flatnonzero(row.model.body_weldid == row.model.body_weldid[row.body_of(place)])
        row.field("body_mass")[link] *= 1.0 + float(values[0])
        row.field("body_inertia")[link] *= 1.0 + float(values[0])
        if row.model.body_gravcomp[link].any():
            row.field("body_gravcomp")[link] /= 1.0 + float(values[0])


EFFECT = InertiaError()
