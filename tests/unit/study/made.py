"""Studies made for tests: a folder with orders, and sessions that somebody played."""

from pathlib import Path

import msgspec

from shared.clock import ManualClock
from shared.study.drawing import draw_orders
from shared.study.events import (
    Answer,
    Answered,
    Consented,
    Event,
    GameEnded,
    GameStarted,
    Ranked,
    Repeated,
    SessionBegan,
    SessionEnded,
    StepBegan,
    StepDone,
)
from shared.study.folder import Study, hash_of, make_study
from shared.study.journal import FILE
from shared.study.protocol_file import shipped_protocol
from shared.study.recorded import HEART_RATE, refresh
from shared.study.rows import HeartRateRow
from shared.study.tsv import RowLog

AT = 1.8e9
"""When all this happens (s since 1970)."""


def study_in(folder: Path, name: str = "template", people: int = 4, seed: int = 7) -> Study:
    """Make a study from a shipped protocol, with orders."""
    clock = ManualClock(AT)
    make_study(folder, shipped_protocol(name).read_bytes(), name, "1.0", clock)
    return draw_orders(folder, people, seed, clock)


def answer_to(item) -> Answer:
    if isinstance(item.scale, int):
        return Answer(value=2)
    if item.scale == "choices":
        several = (item.options[0], item.other) if item.is_several else item.options[:1]
        return Answer(chosen=several, text="my\town\nwords" if item.is_several else "")
    return Answer(text='said "n/a"; then\t\\n')


def play(study: Study, participant: str, is_repeated: str = "") -> None:
    """Walk a whole session; the game of step ``is_repeated`` is played twice."""
    clock = ManualClock(AT + 60.0)
    folder = study.session_folder(participant)
    labels = study.labels_of(participant)
    folder.mkdir(parents=True)
    events: list[Event] = []
    with RowLog(folder / HEART_RATE, HeartRateRow) as heart:

        def write(what, step=""):
            clock.advance(0.5)
            at = clock.wall_ns()
            event = Event(number=len(events) + 1, t_ns=at, wall_ns=at, step=step, what=what)
            events.append(event)
            return event

        write(
            SessionBegan(
                participant=participant, session=1, order=labels, study=study.protocol.name,
                protocol=study.protocol_hash, config="c" * 64, commit="abc", version="1.0",
            )
        )  # fmt: skip
        for step in study.steps_of(participant):
            write(StepBegan(), step.id)
            attempts = 2 if step.id == is_repeated else 1
            for attempt in range(1, attempts + 1 if step.player else 1):
                bout, policy = f"{step.id}-{attempt}", f"sha256:{hash_of(step.player.encode())}"
                write(
                    GameStarted(attempt=attempt, bout=bout, policy=policy, seconds=step.seconds),
                    step.id,
                )
                event = write(
                    GameEnded(
                        attempt=attempt, bout=bout, policy=policy, outcome="finished",
                        score=100.0 * step.section + step.game, attack_steps=7, penalty_steps=0,
                        camping_steps=0, steps=2000, seconds=20.0, archive=f"bouts/{bout}",
                    ),
                    step.id,
                )  # fmt: skip
                label = labels[step.section - 1] if step.section else ""
                heart.write(
                    HeartRateRow(
                        participant=participant, session=1, t_ns=event.t_ns,
                        wall="2027-01-15T08:00:00.000000Z", bpm=81.25, contact=True, step=step.id,
                        section=step.section, condition=label, game=step.game, attempt=attempt,
                        source="strap", policy=policy, config="c" * 64,
                    )
                )  # fmt: skip
                if attempt < attempts:
                    write(Repeated(attempt=attempt, reason="the phone rang"), step.id)
            if step.kind == "consent":
                write(Consented(statements=study.protocol.consent.statements), step.id)
            if step.instrument:
                items = study.protocol.instrument_named(step.instrument).item
                if step.kind == "ranking":
                    ranks = {section: 1 + section // 2 for section in range(1, step.section + 1)}
                    answered = Ranked(
                        instrument=step.instrument, ranks={item.id: ranks for item in items}
                    )
                else:
                    answered = Answered(
                        instrument=step.instrument,
                        answers={item.id: answer_to(item) for item in items},
                    )
                write(answered, step.id)
            write(StepDone(), step.id)
        write(SessionEnded())
    # At once: an event a sync, as the journal does it, takes a test a second.
    (folder / FILE).write_bytes(b"".join(msgspec.json.encode(event) + b"\n" for event in events))
    refresh(study)
