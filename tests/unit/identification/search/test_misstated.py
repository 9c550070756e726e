"""Which of two searches is believed: with a number of the base free, or as the file has it."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from shared.identification.catalogue import effects
from shared.identification.effect import Candidate
from shared.identification.progress import silent
from shared.identification.search import misstated as module

_RUBS, _PUSHED = (
    Candidate(next(each for each in effects() if each.name == name), "elbow")
    for name in ("coulomb_friction", "torque_bias")
)


def _search(is_open: bool, named: tuple[Candidate, ...], left: float) -> Any:
    """Return a search that is over, as far as it is asked here."""
    problem = SimpleNamespace(parameters=[SimpleNamespace(name="friction_loss elbow")])
    return SimpleNamespace(
        problem=problem, base=None, candidates=(), doubted=(), ruled_out={}, is_open=is_open,
        accepted=[SimpleNamespace(candidate=each) for each in named],
        base_losses=np.full(8, 2.0 * left), current_losses=np.full(8, left),
    )  # fmt: skip


@pytest.mark.parametrize(
    ("is_open", "named", "is_other_open", "left", "is_taken"),
    [
        (False, (_RUBS,), False, 1.0, True),
        (False, (_PUSHED,), False, 1.0, False),  # the number of the file is not told to be wrong
        (True, (_PUSHED,), False, 1.0, True),  # but nothing else explains what is left
        (True, (_PUSHED,), True, 1.0, False),
        (True, (), False, 1.0, False),
        (True, (_PUSHED,), False, 9.0, False),
    ],
)
def test_the_file_is_believed_if_a_cause_explains_all_beside_it(
    monkeypatch: pytest.MonkeyPatch,
    is_open: bool,
    named: tuple[Candidate, ...],
    is_other_open: bool,
    left: float,
    is_taken: bool,
):
    other = _search(is_other_open, named, left)
    found = _search(is_open, (), 1.5)
    monkeypatch.setattr(module, "_wrong", lambda *_: {"friction_loss elbow": _RUBS})
    monkeypatch.setattr(module, "begin_without", lambda *_, **__: other)
    monkeypatch.setattr(module, "doubted_of", lambda _: ())
    monkeypatch.setattr(module, "search", lambda *_: None)
    monkeypatch.setattr(module, "clear", lambda *_: None)
    monkeypatch.setattr(module, "is_open", lambda each: each.is_open)
    untouched = _search(True, (), 1.5)
    taken = module.misstated(found, untouched, effects(), 0, silent)
    assert (taken is other) == is_taken
    assert other.freer.losses is untouched.base_losses
