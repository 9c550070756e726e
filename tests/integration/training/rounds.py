"""What must hold of the rounds of phase two, however they came about."""

from pathlib import Path

import numpy as np

from services.jobs.reproduction.draws import replay
from services.league.events import BoutsPlayed
from services.league.ledger import open_read_only
from services.league.rounds import Turn, rounds_stages
from shared.messages.training import AGENTS
from shared.policy.snapshot import unpack


def assert_rounds_are_whole(folder: Path, rounds: int, iterations: int, updates: int) -> None:
    """Every turn was taken once, in order, with its updates, against whom the sampler draws."""
    with open_read_only(folder / "league.sqlite") as ledger:
        entries = list(ledger.replay())
    state, draws = replay(entries)
    assert state.finished
    assert [number for number, _, _ in state.library()] == list(range(1, rounds + 1))
    expected = [
        Turn(number, iteration, agent)
        for number in range(1, rounds + 1)
        for iteration in range(1, iterations + 1)
        for agent in AGENTS
    ]
    records = [record for record in state.stages if record.stage.round]
    assert [Turn(r.stage.round, r.stage.iteration, r.stage.agent) for r in records] == expected
    assert {record.updates for record in records} == {updates}
    assert {(r.stage.score_weight, r.stage.shaping_weight) for r in records} == {(1.0, 0.0)}
    assert len(draws) == len(records)
    assert all(draw.is_replayed for draw in draws)
    assert state.repeated_rollouts == 0
    played = [e.event for e in entries if isinstance(e.event, BoutsPlayed) and e.event.stage >= 0]
    assert any(state.stages[bouts.stage].stage.round for bouts in played)
    for bouts in played:  # one opponent from start to end: its stage's
        stage = state.stages[bouts.stage].stage
        met = bouts.protagonist if stage.agent == "antagonist" else bouts.antagonist
        assert met == stage.opponent
        assert state.leases[bouts.lease].grant.stage == bouts.stage
    warm = dict(zip(AGENTS, state.warm_start() or (), strict=True))
    for number in range(1, rounds + 1):
        first = rounds_stages(state, number)[: len(AGENTS)]
        for record in first:
            agent = record.stage.agent
            assert (record.stage.start, record.restarts) == ("warm", 1)
            begun, wanted = (_policy(folder, ref) for ref in (record.versions[0].ref, warm[agent]))
            assert all(np.array_equal(*pair) for pair in zip(begun, wanted, strict=True))
    stored = {path.stem for path in (folder / "snapshots").iterdir()}
    known = {v.snapshot for versions in state.versions.values() for v in versions.values()}
    assert known <= stored


def _policy(folder: Path, reference: str) -> list[np.ndarray]:
    digest = reference.removeprefix("sha256:")
    payload = (folder / "snapshots" / f"{digest}.safetensors").read_bytes()
    found = unpack(payload, digest).weights
    return [
        found.obs_mean,
        found.obs_std,
        found.log_std,
        *(a for pair in found.layers for a in pair),
    ]
