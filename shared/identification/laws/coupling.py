"""Two joints behind one differential, as tendons."""

from collections.abc import Callable

from shared.sim.plant.plant import Plant
from shared.sim.plant.structure import Builder


def couple(before: str, last: str) -> Callable[[Builder], None]:
    """Return what adds tendons as long as sum and difference of two logged joints' angles."""

    def change(builder: Builder) -> None:
        names = coupling_names(builder.plant, last)
        for name, sign in zip(names, (1.0, -1.0), strict=True):
            tendon = builder.spec.add_tendon(name=name)
            tendon.wrap_joint(builder.plant.mj_joint(before), 1.0)
            tendon.wrap_joint(builder.plant.mj_joint(last), sign)

    return change


def coupling_names(plant: Plant, last: str) -> tuple[str, str]:
    """Return the MJCF's names of the tendons: of the sum, of the difference."""
    joint = plant.mj_joint(last)
    return f"{joint}/sum", f"{joint}/difference"
