"""What the runner puts on the participant's page, over a session with the real referee."""

from pathlib import Path

import msgspec
import pytest

from services.study.view import ParticipantView
from shared.study.drawing import draw_orders
from shared.study.folder import make_study
from tests.unit.study.runner_stand import AT, SHORT, ManualClock, Stand


def stand_with(folder: Path, game: str) -> Stand:
    text = SHORT.replace("[game]", f"[game]\n{game}").replace(
        "title =", 'language = "de"\ntitle =', 1
    )
    make_study(folder, text.encode(), "short.toml", "1.0", ManualClock(AT))
    draw_orders(folder, 4, 1, ManualClock(AT))
    return Stand(folder)


def views_until(stand: Stand, end: str) -> list[ParticipantView]:
    """Walk to a step, as who answers what the page shows; return every view on the way."""
    views: list[ParticipantView] = []

    def is_there() -> bool:
        view, step = stand.pages.participant, stand.session.step
        if view is not None:
            views.append(view)
        if step is None or (view is not None and view.step == step.id):
            stand.help_on()
        return stand.session.is_over or (
            stand.session.step is not None and stand.session.step.id == end
        )

    stand.until(is_there, 200.0)
    return views


@pytest.mark.parametrize(
    ("score", "screens"),
    [("never", set[str]()), ("after", {"score"}), ("always", {"score", "playing"})],
)
def test_the_score_is_shown_when_the_protocol_says_so(
    tmp_path: Path, score: str, screens: set[str]
):
    stand = stand_with(tmp_path / "study", f'score = "{score}"')
    views = views_until(stand, "s1-rest-01")
    assert {"countdown", "playing", "score", "text", "consent"} <= {view.screen for view in views}
    assert {view.screen for view in views if view.score is not None} == screens
    stand.study.close()


@pytest.mark.slow
def test_a_participant_never_sees_which_condition_it_is(tmp_path: Path):
    stand = stand_with(tmp_path / "study", "")
    said = b" ".join(msgspec.json.encode(view) for view in views_until(stand, ""))
    for name in (b"easy", b"hard", b"scripted", b"guard", b"heuristic", b"policy"):
        assert name not in said
    assert b'"language":"de"' in said
    assert b'"screen":"ranking"' in said
    stand.study.close()
