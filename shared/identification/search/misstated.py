"""Looks for a number of the model file that is wrong, as for any other cause.

The base may be anything, so of a joint that rubs three times as much as its file says nothing is
left to be named. Where a joint or two are so far off, the search is made once more with those
numbers as the file has them; what is added to them stands among the other candidates then, and has
to pass what every cause has to.
"""

from collections.abc import Sequence

from shared.identification.effect import Candidate, Effect
from shared.identification.progress import Progress
from shared.identification.search.begin import begin_without, doubted_of
from shared.identification.search.bent import is_worse
from shared.identification.search.cleared import clear
from shared.identification.search.far import FEW, shown_far
from shared.identification.search.rounds import search
from shared.identification.search.searched import Model, Search, is_open
from shared.telemetry.wording import listing

_EFFECTS = {
    "friction_loss": "coulomb_friction",
    "armature": "rotor_inertia",
    "damping": "viscous_friction",
}
"""What adds to a number of the base, by what that is called."""


def misstated(
    found: Search, untouched: Search, effects: Sequence[Effect], seed: int, progress: Progress
) -> Search | None:
    """Return a search that names what the model file has wrong at a joint or two, if one does.

    Or one that explains all by other causes with those numbers as the file has them, if nothing
    else does: a base that is free to be wrong there may hide a cause.

    Args:
        found: a search, over.
        untouched: the same as it began.
        effects: what may be named.
        seed: of everything random.
        progress: is told how far it is.
    """
    wrong = _wrong(found, {each.name: each for each in effects})
    if not wrong:
        return None
    names = [each.name for each in untouched.problem.parameters]
    progress("screen", 0.0, f"again, with {listing(list(wrong))} as the model file has it")
    other = begin_without(untouched, [names.index(name) for name in wrong], seed=seed)
    bent = [other.problem.parameters[index].name for index in doubted_of(other.base)]
    if bent:
        # Of an arm whose masses, gains and other frictions are all as much smaller it is right.
        gone = [names.index(name) for name in (*wrong, *bent)]
        other = begin_without(untouched, gone, seed=seed)
    other.doubted = (*untouched.doubted, *bent)
    other.freer = Model(untouched.base, untouched.base_losses)
    other.candidates = (*other.candidates, *wrong.values())
    known = {each.effect.name for each in wrong.values()}
    other.ruled_out = {name: why for name, why in other.ruled_out.items() if name not in known}
    search(other, progress)
    clear(other, progress)
    named = {each.candidate for each in other.accepted}
    is_told = named.issuperset(wrong.values())
    if is_open(other) or not named or not (is_told or is_open(found)):
        return None
    return None if is_worse(other.current_losses, found.current_losses) else other


def _wrong(found: Search, effects: dict[str, Effect]) -> dict[str, Candidate]:
    """Return which numbers of joints are surely far from the file, each with what adds to it."""
    parameters = found.current.space.problem.parameters
    far = [parameters[index].name for index in shown_far(found)]
    if len(far) > FEW:
        return {}
    wrong: dict[str, Candidate] = {}
    for name in far:
        word, _, joint = name.partition(" ")
        effect = effects.get(_EFFECTS.get(word, ""))
        if effect is not None:
            wrong[name] = Candidate(effect, joint)
    return wrong
