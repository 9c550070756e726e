"""The scene as a viewer without MuJoCo needs it: which body hangs on which, and by what hinge."""

from dataclasses import dataclass

from shared.sim.model import FencingModel

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]


@dataclass(frozen=True)
class Link:
    """One body; its frame at joint angle 0 in its parent's frame."""

    name: str
    parent: int
    """Index of the body it hangs on; -1 for the world itself."""
    position: Vector
    """m."""
    quaternion: Quaternion
    """w x y z."""
    axis: Vector | None
    """Of its hinge, through its origin, in its own frame; None where it does not turn."""
    joint: int
    """Index into the joint angles, antagonist's seven first; -1 where it does not turn."""


def chain_of(model: FencingModel) -> tuple[Link, ...]:
    """Return the bodies in the order of ``model.body_names``, parents before children."""
    mj = model.mj
    links: list[Link] = []
    for index in range(mj.nbody):
        body = mj.body(index)
        turns = int(body.jntnum[0]) == 1
        joint = int(body.jntadr[0]) if turns else -1
        links.append(
            Link(
                name=body.name,
                parent=int(body.parentid[0]) if index else -1,
                position=tuple(body.pos.tolist()),
                quaternion=tuple(body.quat.tolist()),
                axis=tuple(mj.jnt_axis[joint].tolist()) if turns else None,
                joint=joint,
            )
        )
    return tuple(links)
