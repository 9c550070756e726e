"""A scripted session: the views of every screen, as a runner would show them."""

from collections.abc import Sequence

import msgspec

from services.study.forms import items_of
from services.study.view import (
    BoutView,
    GameView,
    GateView,
    HeartView,
    Item,
    NoteView,
    ParticipantView,
    ResearcherView,
    ServiceView,
    StepView,
    TrackerView,
)
from shared.study.protocol import Protocol
from shared.study.protocol_file import load_protocol, shipped_protocol
from shared.study.steps import Step, steps_of

SESSION = "5f0c"


def study_one() -> tuple[Protocol, tuple[Step, ...]]:
    protocol = load_protocol(shipped_protocol("study-one"))
    return protocol, steps_of(protocol, [each.name for each in protocol.condition])


def items(name: str, sections: Sequence[int] = ()) -> tuple[Item, ...]:
    return items_of(study_one()[0].instrument_named(name), sections)


def participant(screen: str, **fields: object) -> ParticipantView:
    said: dict[str, object] = {
        "screen": screen, "session": SESSION, "step": f"step-{screen}", "sections": 4, "total": 68,
    }  # fmt: skip
    return msgspec.convert({**said, **fields}, ParticipantView)


def screens() -> dict[str, ParticipantView]:
    """Return every screen, by a name for its picture."""
    protocol, steps = study_one()
    told = {step.id: step for step in steps}
    game = {"section": 2, "game": 3, "games": 5, "done": 31}
    seated, explore = told["baseline-resting"], told["explore"]
    return {
        "welcome": participant("welcome", title=protocol.title, step="welcome"),
        "consent": participant(
            "consent", title=protocol.consent.title, may=("consent",), step="consent",
            text=protocol.consent.text * 3, statements=protocol.consent.statements,
        ),
        "instruction": participant(
            "text", title=told["instruction"].title, text=told["instruction"].text, may=("ready",),
            step="instruction", done=5,
        ),
        "baseline": participant(
            "text", title=seated.title, text=seated.text, seconds=180.0, seconds_left=134.2,
            step=seated.id, done=3,
        ),
        "countdown": participant("countdown", seconds=5.0, seconds_left=2.4, **game),
        "warm-up": participant(
            "countdown", seconds=5.0, seconds_left=4.4, is_recorded=False, game=1, games=2, done=7
        ),
        "playing": participant("playing", seconds=20.0, seconds_left=12.6, score=214.0, **game),
        "exploring": participant(
            "playing", title=explore.title, text=explore.text, seconds=300.0, seconds_left=242.0,
            step="explore", is_recorded=False, done=6,
        ),
        "playing-hidden": participant("playing", seconds=20.0, seconds_left=7.2, **game),
        "score": participant("score", score=383.0, **game),
        "rest": participant("rest", seconds=30.0, seconds_left=21.3, may=("ready",), **game),
        "adjectives": participant(
            "questionnaire", step="s2-q-adjectives", title="The last five games", section=2,
            items=items("adjectives"), may=("answers",), done=35,
        ),
        "opinion": participant(
            "questionnaire", step="q-tam", title="Your opinion", text="How far do you agree?",
            items=items("tam"), may=("answers",), done=64,
        ),
        "opinion-paged": participant(
            "questionnaire", step="q-tam-paged", title="Your opinion", items=items("tam"),
            text="How far do you agree?", is_paged=True, may=("answers",), done=64,
        ),
        "ranking": participant(
            "ranking", step="s4-r-comparison", title="Compare the sections", section=4, done=63,
            text="Put the sections you have finished in order.", may=("ranking",),
            items=items("comparison", range(1, 5)),
        ),
        "open": participant(
            "questionnaire", step="q-improvement", title="In your own words", may=("answers",),
            items=items("improvement"), done=66,
        ),
        "about-you": participant(
            "questionnaire", step="q-about-you", title="About you", may=("answers",),
            items=items("about-you"), done=1,
        ),
        "waiting": participant("waiting", done=12),
        "paused": participant(
            "playing", seconds=20.0, seconds_left=12.6, is_paused=True, **game
        ),
        "debrief": participant(
            "thanks", title=protocol.end.title, text=protocol.end.text, done=67, may=("ready",),
            step="debrief",
        ),
        "thanks": participant("thanks", step="", done=68),
        "german": participant(
            "questionnaire", step="q-tam-de", title="Ihre Meinung", language="de", section=2,
            items=[
                Item(id="PU", text="Ein Roboter als Gegner würde mein Training verbessern.",
                     scale="points"),
                Item(id="PENJ", text="Spiele gegen den Roboter sind unterhaltsam.",
                     scale="points", is_required=False),
            ],
            may=("answers",), done=64,
        ),
    }  # fmt: skip


def step_view(step: Step) -> StepView:
    return StepView(
        id=step.id, kind=step.kind, title=step.title, section=step.section, game=step.game,
        condition="ABCD"[step.section - 1] if step.condition else "", seconds=step.seconds,
        is_recorded=step.is_recorded,
    )  # fmt: skip


def researcher(at: str = "s2-g03", **fields: object) -> ResearcherView:
    protocol, steps = study_one()
    ids = [step.id for step in steps]
    beats = [88.0 + 0.4 * k + (k % 7) for k in range(100)]
    games = tuple(
        GameView(
            step=f"s{1 + k // 5}-g{1 + k % 5:02d}", section=1 + k // 5, game=1 + k % 5, attempt=1,
            outcome="finished", is_recorded=True, score=50.0 * k - 120.0,
            condition="AB"[k // 5], may=("void", "repeat"),
        )
        for k in range(7)
    )  # fmt: skip
    said = ResearcherView(
        study=protocol.title,
        participant="sub-04",
        course="running",
        steps=tuple(step_view(step) for step in steps),
        at=ids.index(at),
        seconds_left=12.6,
        screen="playing",
        is_participant_here=True,
        bout=BoutView(
            bout="s2-g03-a1", phase="running", seconds=7.4, score=214.0, attack_steps=284,
            penalty_steps=7,
        ),
        heart=HeartView(
            beats_per_minute=131.0, source="Polar OH1", seated=68.0, walking=96.0,
            recent=(*beats[:60], None, None, None, *beats[63:]),
        ),
        tracker=TrackerView(is_tracked=True),
        gate=GateView(mode="armed"),
        services=(
            ServiceView(name="robot_io", is_alive=True, state="100.0 ticks a second"),
            ServiceView(name="referee", is_alive=True, state="running"),
            ServiceView(name="policy", is_alive=True, state="plays"),
            ServiceView(name="recorder", is_alive=True, state="recording"),
        ),
        may=("pause", "void", "repeat", "note", "disarm", "abort"),
        games=(
            *games[:3],
            msgspec.structs.replace(
                games[3], outcome="void", may=(), reason="the tracker was lost for 1.2 s"
            ),
            msgspec.structs.replace(games[3], attempt=2),
            *games[4:],
        ),
        notes=(
            NoteView(at="14:02:11", step="s1-g04", text="Stepped over the line once."),
            NoteView(at="14:09:40", step="s2-g01", text="Says the bat is light."),
        ),
    )  # fmt: skip
    return msgspec.structs.replace(said, **fields)


TEXT = participant("text", title="Read this", text="One.\n\nTwo.", may=("ready",), step="t1")


def form(*items: Item, **fields: object) -> ParticipantView:
    given = {"step": "q1", "title": "Q", "may": ("answers",), **fields}
    return participant("questionnaire", items=items, **given)


def points(name: str, *, is_required: bool = True) -> Item:
    return Item(id=name, text=f"About {name}?", scale="points", is_required=is_required)


OPEN = Item(id="why", text="And why?", scale="open", is_required=False)
