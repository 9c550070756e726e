"""The style of evaluations, and what an actor that plays a tournament keeps in memory."""

import os
import subprocess
import sys

import numpy as np
import psutil

from services.actor.evaluation import Evaluation
from services.actor.opponents import MOST_FETCHES, Opponents
from shared.bus.memory import MemoryHub
from shared.clock import ManualClock
from shared.messages.league import FEATURE_DIM, SnapshotReply
from shared.messages.topics import SNAPSHOT
from shared.messages.training import OBS_DIM
from shared.policy.mlp import GaussianPolicy
from shared.policy.players import SnapshotPlayer, StaticPlayer
from shared.policy.scripted.sight import Arena
from shared.policy.snapshot import pack
from shared.styles.features import FEATURES, StyleMeter
from tests.unit.actor.driving import BOUT_STEPS, WORLDS, worlds
from tests.unit.policy.making import FIT, card, snapshot, weights

PLAYERS = (SnapshotPlayer(GaussianPolicy(weights(seed=3)), stochastic=True), StaticPlayer())
SNAPSHOTS = 500
CAPACITY = 16


def test_the_wire_has_room_for_every_feature():
    assert len(FEATURES) == FEATURE_DIM


def test_features_and_scores_equal_those_of_the_same_bouts_stepped_and_judged_one_by_one():
    results = Evaluation(worlds(), PLAYERS, 5, seed=4).advance(BOUT_STEPS)
    assert results is not None
    env, generator = worlds(), np.random.default_rng(4)
    env.reset(np.arange(WORLDS), generator)
    meter = StyleMeter(WORLDS, 0.01)
    obs = [np.empty((WORLDS, OBS_DIM), np.float32) for _ in PLAYERS]
    for _ in range(BOUT_STEPS):
        env.observe(*obs)
        env.step(*(p.act(seen, generator) for p, seen in zip(PLAYERS, obs, strict=True)))
        sensors = env.batch.sensors.reshape(WORLDS, 2, 20)
        positions, velocities = (sensors[:, :, at : at + 3].transpose(2, 1, 0) for at in (0, 7))
        meter.add(positions.copy(), velocities.copy())
    assert results.score.tobytes() == env.scores.score[:5].astype(np.float32).tobytes()
    assert results.penalty_steps.tobytes() == env.scores.penalty_steps[:5].tobytes()
    assert results.features.shape == (5, 2, FEATURE_DIM)
    assert results.features.tobytes() == meter.features()[:5].tobytes()
    assert results.features[:, 0, 3].min() > results.features[:, 1, 3].max()  # one holds still


def test_the_features_do_not_depend_on_how_often_the_actor_comes_up_for_air():
    whole = Evaluation(worlds(), PLAYERS, 8, seed=4).advance(BOUT_STEPS)
    pieces = Evaluation(worlds(), PLAYERS, 8, seed=4)
    results = None
    while results is None:
        results = pieces.advance(7)
    assert whole is not None
    assert results.features.tobytes() == whole.features.tobytes()
    assert results.score.tobytes() == whole.score.tobytes()


def test_an_actor_loads_no_library_of_the_styles():
    code = (
        "import sys, services.actor.__main__; "
        "heavy = {'sklearn', 'scipy', 'pyarrow', 'torch', 'matplotlib'} & set(sys.modules); "
        "assert not heavy, heavy"
    )
    done = subprocess.run(
        [sys.executable, "-P", "-c", code], capture_output=True, text=True, timeout=60
    )
    assert done.returncode == 0, done.stderr


def test_memory_does_not_grow_with_the_number_of_opponents_met():
    clock = ManualClock(0.0)
    hub = MemoryHub(clock)
    league = hub.join("league-0").answer(SNAPSHOT)
    opponents = Opponents(hub.join("actor-0"), clock, FIT, Arena(), CAPACITY, timeout=5.0)
    process = psutil.Process(os.getpid())
    rss: list[int] = []
    for number in range(SNAPSHOTS):
        policy = weights((128, 128), seed=number)
        made = pack(card(policy), policy)
        assert opponents.get(made.reference, stochastic=False) is None
        request = league.take()
        assert request is not None
        payload = np.frombuffer(made.payload, np.uint8)
        request.reply(SnapshotReply(found=True, payload=payload))
        player = opponents.get(made.reference, stochastic=False)
        assert isinstance(player, SnapshotPlayer)
        assert len(opponents) == min(number + 1, CAPACITY)
        assert opponents.fetches == 0
        rss.append(process.memory_info().rss)
    met_since = SNAPSHOTS - SNAPSHOTS // 5
    grown, weight = rss[-1] - rss[SNAPSHOTS // 5], met_since * len(made.payload)
    assert weight > 30e6
    assert grown < weight / 4, f"{grown / 1e6:.1f} MB more after {met_since} of {weight / 1e6:.1f}"


def test_fetches_that_nobody_waits_for_any_more_are_forgotten():
    clock = ManualClock(0.0)
    hub = MemoryHub(clock, max_messages=1024)
    league = hub.join("league-0").answer(SNAPSHOT)
    opponents = Opponents(hub.join("actor-0"), clock, FIT, Arena(), CAPACITY, timeout=5.0)
    lost = SnapshotReply(found=False, payload=np.zeros(0, np.uint8), reason="lost")
    for number in range(100):
        made = snapshot(seed=number)
        assert opponents.get(made.reference, stochastic=False) is None  # and its lease ends
        request = league.take()
        assert request is not None
        if number % 2:
            request.reply(lost)
            assert opponents.get(made.reference, stochastic=False) is None
        clock.advance(0.1)
        assert opponents.fetches <= 2 * MOST_FETCHES
    assert opponents.last_failure.endswith("lost")
    made = snapshot(seed=0)  # and one of those is met again
    clock.advance(5.0)
    assert opponents.get(made.reference, stochastic=False) is None
    request = league.take()
    assert request is not None
    request.reply(SnapshotReply(found=True, payload=np.frombuffer(made.payload, np.uint8)))
    assert opponents.get(made.reference, stochastic=False) is not None
