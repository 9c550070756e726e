"""The list in ``docs/effects.md``: every effect of the catalogue, from the code that has it.

``python -m shared.identification.hidden.catalogue_page docs/effects.md`` renews it.
"""

import inspect
import re
import sys
from collections.abc import Callable, Sequence

from shared.identification.arm.subject import Subject, subject_of
from shared.identification.catalogue import effects
from shared.identification.effect import Effect, Side
from shared.identification.hidden.generator import simulated
from shared.identification.hidden.recipe import Recipe
from shared.messages.markdown import renew_main
from shared.sim.hidden.arms import ArmName

BEGIN = "<!-- effects:begin -->"
END = "<!-- effects:end -->"
_SIDES: dict[Side, str] = {
    "command": "Before the controller: commands",
    "plant": "How the arm moves",
    "joints": "What encoders say",
    "tracker": "What the tracker says",
}
_ARMS: tuple[ArmName, ...] = ("torque2", "arm3", "pr2")
"""Of which one shows what an effect's numbers are called."""


def describe() -> str:
    """Return the catalogue as Markdown."""
    subjects = [_subject(arm) for arm in _ARMS]
    parts: list[str] = []
    for side, title in _SIDES.items():
        parts += [f"### {title}", ""]
        for effect in effects():
            if effect.side == side:
                parts += [_described(effect, subjects), ""]
    return "\n".join(parts).rstrip()


def _subject(arm: ArmName) -> Subject:
    """Return an arm with short recordings of it, a tracker among them."""
    recipe = Recipe(arm=arm, seconds=2.0, train=1, test=1, has_shares=False)
    return subject_of(simulated(recipe)[0])


def _described(effect: Effect, subjects: Sequence[Subject]) -> str:
    numbers = ", ".join(
        f"`{name}`" + (f" ({unit})" if unit != "1" else "")
        for name, unit in _units(effect, subjects).items()
    )
    about = " ".join(_plain(inspect.getdoc(type(effect)) or "").split())
    return "\n".join(
        (
            f"**`{effect.name}`**: {effect.title}.",
            f"- {about}",
            f"- Where: {_returned(effect.places)}",
            f"- Numbers: {numbers}. {_capital(_returned(effect.quantities))}",
            f"- How it shows: {effect.signature}",
        )
    )


def _units(effect: Effect, subjects: Sequence[Subject]) -> dict[str, str]:
    """Return the units of an effect's numbers by name, of every place that it may have."""
    places = [(subject, place) for subject in subjects for place in effect.places(subject)]
    last = subjects[-1]
    return {
        each.name: each.unit
        for subject, place in places or [(last, last.joints[0])]
        for each in effect.quantities(subject, place)
    }


def _returned(method: Callable[..., object]) -> str:
    """Return what the docstring of a method says that it returns."""
    text = " ".join(_plain(inspect.getdoc(method) or "").split())
    return text.removeprefix("Return ")


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]


def _plain(text: str) -> str:
    """Return a docstring's text as Markdown."""
    return re.sub(r"``([^`]*)``", r"`\1`", text)


def main(argv: Sequence[str] | None = None) -> int:
    """Renew the list in a document; return the exit code."""
    return renew_main("shared.identification.hidden.catalogue_page", BEGIN, END, describe, argv)


if __name__ == "__main__":
    sys.exit(main())
