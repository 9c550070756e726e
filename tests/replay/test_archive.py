"""The referee's score is what the rule book makes of the archived bat states, to the last bit."""

import itertools
from pathlib import Path

import msgspec
import numpy as np
import pytest

from services.recorder.config import RecorderConfig
from shared.errors import RiposteError
from shared.game.live import judge_states
from shared.game.recount import judged_ticks, recount
from shared.game.rules import RuleBook
from shared.messages.play import RefereeState
from shared.sim.arena import bat_of, target_of
from shared.sim.config import SimConfig
from shared.telemetry.archive import ArchivedBout, archived_bouts, load_bout
from tests.replay.recorded import RecordedBouts, play
from tests.unit.recorder.fencing import Fencing

RULES = RuleBook(bout_steps=100, camping_steps=20)
ONLY_ARCHIVE = RecorderConfig(live=False, file=False, min_free_mib=0)
PAIRS = tuple(itertools.product(("stab", "slash"), ("heuristic", "guard")))
BOUTS = 5
"""Of each pair; 20 in all."""
COUNTERS = ("score", "attack_steps", "penalty_steps", "camping_steps")


@pytest.fixture(scope="module")
def recorded() -> list[RecordedBouts]:
    return [play(*pair, RULES, BOUTS, seed) for seed, pair in enumerate(PAIRS)]


def again(bout: ArchivedBout) -> dict[str, float]:
    """Return the counters of a bout by the rules and the scene that its archive names."""
    rules = msgspec.convert(bout.info.sections["game"], RuleBook)
    sim = msgspec.convert(bout.info.sections["sim"], SimConfig)
    scores = recount(bout, rules, bat_of(sim), target_of(sim))
    return {name: getattr(scores, name)[0].item() for name in COUNTERS}


def said(state: RefereeState | None) -> dict[str, float]:
    assert state is not None
    return {name: getattr(state, name) for name in COUNTERS}


def test_the_score_of_20_live_bouts_is_recounted_from_their_archive(
    recorded: list[RecordedBouts], tmp_path: Path
):
    fencing = Fencing(tmp_path, ONLY_ARCHIVE, rules=RULES)
    generator = np.random.default_rng(3)
    verdicts: dict[str, dict[str, float]] = {}
    for pair, bouts in enumerate(recorded):
        for world in range(BOUTS):
            name = f"bout {pair}.{world}"
            fencing.start(name, bouts.first[world])
            for bats in bouts.bats[:, world]:  # in every second bout some ticks are lost
                fencing.bring(bats, lost=world % 2 == 1 and generator.random() < 0.05)
            while fencing.state is None or fencing.state.phase != "finished":
                fencing.bring(bouts.bats[-1, world])
            verdicts[name] = said(fencing.state)
            fencing.rest(bouts.first[world], 5)
    fencing.recorder.close()

    found = [load_bout(folder) for folder in archived_bouts(tmp_path)]
    assert [bout.info.bout for bout in found] == [*verdicts]
    for bout in found:
        assert bout.info.outcome == "finished"
        assert again(bout) == verdicts[bout.info.bout]
        assert {name: getattr(bout.info, name) for name in COUNTERS} == verdicts[bout.info.bout]
        assert len(judged_ticks(bout)) == RULES.bout_steps
        assert sum(stream.dropped for stream in bout.info.streams.values()) == 0
    assert sum(bout.info.missed_ticks for bout in found) > 20
    assert len({verdict["score"] for verdict in verdicts.values()}) > 10
    assert sum(verdict["penalty_steps"] > 0 for verdict in verdicts.values()) > 3


def test_a_pause_for_lost_tracking_is_recounted_too(recorded: list[RecordedBouts], tmp_path: Path):
    bouts, world = recorded[2], 0
    fencing = Fencing(tmp_path, ONLY_ARCHIVE, rules=RULES)
    fencing.start("paused", bouts.first[world])
    for step, bats in enumerate(bouts.bats[:, world]):
        fencing.bring(bats)
        if step == 50:
            for _ in range(40):
                fencing.bring(bats, valid=False)
            assert fencing.state is not None
            assert fencing.state.phase == "paused"
            fencing.rest(bouts.bats[20, world], 30)  # 0.2 s of good tracking resume it
    fencing.rest(bouts.bats[-1, world], 60)
    assert fencing.state is not None
    assert fencing.state.phase == "finished"
    fencing.recorder.close()

    bout = load_bout(archived_bouts(tmp_path)[0])
    assert again(bout) == said(fencing.state)
    plain = [k for k, tick in enumerate(judged_ticks(bout)) if tick]
    assert len(plain) == RULES.bout_steps


def test_a_wrong_bat_state_changes_the_recount(recorded: list[RecordedBouts], tmp_path: Path):
    bouts = recorded[0]
    world = int(np.argmax(bouts.results.attack_steps))
    fencing = Fencing(tmp_path, ONLY_ARCHIVE, rules=RULES)
    fencing.start("one", bouts.first[world])
    for bats in bouts.bats[:, world]:
        fencing.bring(bats)
    fencing.rest(bouts.first[world], 5)
    fencing.recorder.close()
    bout = load_bout(archived_bouts(tmp_path)[0])
    right = again(bout)
    assert right == said(fencing.state)
    columns = bout.streams["bats"].columns
    columns["antagonist_position"] = columns["antagonist_position"] + [0.5, 0.0, 0.0]
    assert again(bout) != right


def test_a_bout_recorded_from_its_middle_is_not_recounted(
    recorded: list[RecordedBouts], tmp_path: Path
):
    bouts = recorded[0]
    fencing = Fencing(tmp_path / "first", ONLY_ARCHIVE, rules=RULES)
    fencing.start("one", bouts.first[0])
    for bats in bouts.bats[:30, 0]:
        fencing.bring(bats)
    fencing.recorder.close()
    fencing.replace_recorder(tmp_path / "second", ONLY_ARCHIVE)
    for bats in bouts.bats[30:, 0]:
        fencing.bring(bats)
    fencing.recorder.close()

    first, second = (
        load_bout(archived_bouts(tmp_path / name)[0]) for name in ("first", "second")
    )  # fmt: skip
    assert (first.info.outcome, first.info.reason) == ("interrupted", "the recorder was stopped")
    assert first.info.steps == 30
    assert again(first)["score"] == first.info.score
    assert second.info.outcome == "finished"
    assert second.info.from_step == 30
    with pytest.raises(RiposteError, match="was recorded from step 30 on"):
        again(second)


def test_plain_judging_of_a_whole_bout_gives_the_same(
    recorded: list[RecordedBouts], tmp_path: Path
):
    """Without gaps and pauses the judged ticks are simply those after the start."""
    bouts = recorded[1]
    fencing = Fencing(tmp_path, ONLY_ARCHIVE, rules=RULES)
    fencing.start("one", bouts.first[3])
    for bats in bouts.bats[:, 3]:
        fencing.bring(bats)
    fencing.recorder.close()
    bout = load_bout(archived_bouts(tmp_path)[0])
    start = 30
    np.testing.assert_array_equal(bout.bats()[start:], bouts.bats[:, 3])
    from shared.game.bout import Scoreboard

    scores = Scoreboard(1, RULES, bat_of(SimConfig()), target_of(SimConfig()))
    for bats in bout.bats()[start:]:
        judge_states(scores, bats[None])
    assert scores.score[0] == bout.info.score
