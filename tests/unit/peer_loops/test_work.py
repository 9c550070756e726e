import msgspec
import numpy as np
import pytest

from benchmarks.environments import REQUIREMENTS
from benchmarks.peer_loops.running import work_of
from benchmarks.peer_loops.skill import EVERY, MOST_UPDATES, share_in_target
from benchmarks.peer_loops.work import WARM_UP, Race, Stopwatch, Work
from benchmarks.peers import PEERS
from services.jobs.settings import Settings


def work(seconds: float) -> Work:
    return Work(
        opponent="", num_envs=8, batch_samples=80, hidden_dims=(4,), epochs=1, minibatches=1,
        learning_rate=1e-3, gamma=0.99, gae_lambda=0.95, clip=0.2, entropy_coef=0.0,
        value_loss_coef=1.0, max_grad_norm=1.0, initial_std=0.6, seconds=seconds,
    )  # fmt: skip


def test_the_window_opens_after_the_warm_up_and_holds_only_what_came_later():
    watch = Stopwatch(work(0.0))
    for update in range(1, WARM_UP + 1):
        assert not watch.update_done(80 * update)
    assert watch.update_done(80 * (WARM_UP + 1))
    timing = watch.timing(80 * (WARM_UP + 1))
    assert (timing.samples, timing.updates) == (80, 1)
    assert timing.wall_s > 0.0
    assert timing.resident_mib > 1.0


def test_a_window_goes_on_until_its_time_is_over():
    watch = Stopwatch(work(3600.0))
    assert not any(watch.update_done(80 * update) for update in range(1, 10))


def test_every_peer_gets_whole_rollouts_of_our_own_settings(tmp_path):
    settings = Settings.load(None)
    for peer in PEERS:
        given = work_of(peer, settings, tmp_path / "opponent", 1.0)
        assert given.steps * given.num_envs == settings.learner.batch_samples
        assert msgspec.json.decode(msgspec.json.encode(given), type=Work) == given


def test_every_environment_of_a_benchmark_is_pinned():
    files = {path.stem: path for path in REQUIREMENTS.glob("*.txt")}
    assert {peer.requirements for peer in PEERS if peer.requirements} < set(files)
    for path in files.values():
        lines = path.read_text(encoding="utf-8").split()
        assert lines
        assert all("==" in line for line in lines)


def racing(monkeypatch: pytest.MonkeyPatch, *skills: float) -> Race:
    """A race whose policy is measured to have one skill after the other."""
    found = iter(skills)
    monkeypatch.setattr("benchmarks.peer_loops.work.share_in_target", lambda act: next(found))
    watch = msgspec.structs.replace(work(0.0), skill=0.95).stopwatch()
    assert isinstance(watch, Race)
    return watch


def still(obs: np.ndarray) -> np.ndarray:
    return np.zeros((len(obs), 6), np.float32)


def test_a_race_ends_with_the_skill_and_measures_it_now_and_then(monkeypatch: pytest.MonkeyPatch):
    watch = racing(monkeypatch, 0.2, 0.94, 0.96)
    ends = [watch.update_done(80 * update, still) for update in range(1, 3 * EVERY + 1)]
    assert ends == [False] * (3 * EVERY - 1) + [True]
    timing = watch.timing(80 * 3 * EVERY)
    assert (timing.updates, timing.samples, timing.skill) == (3 * EVERY, 80 * 3 * EVERY, 0.96)


def test_a_race_that_nobody_wins_ends_too(monkeypatch: pytest.MonkeyPatch):
    watch = racing(monkeypatch, *[0.1] * MOST_UPDATES)
    ends = [watch.update_done(80 * update, still) for update in range(1, MOST_UPDATES + 1)]
    assert ends.index(True) == MOST_UPDATES - 1


def test_the_clock_of_a_race_stands_still_while_it_is_measured(monkeypatch: pytest.MonkeyPatch):
    now = 100.0

    def measured(act: object) -> float:
        nonlocal now
        now += 50.0
        return 0.99

    monkeypatch.setattr("benchmarks.peer_loops.work.time.monotonic", lambda: now)
    monkeypatch.setattr("benchmarks.peer_loops.work.Stopwatch._age", lambda self: now - 90.0)
    monkeypatch.setattr("benchmarks.peer_loops.work.share_in_target", measured)
    watch = msgspec.structs.replace(work(0.0), skill=0.95).stopwatch()
    for update in range(1, EVERY + 1):
        watch.update_done(80 * update, still)
    assert watch.timing(80).wall_s == pytest.approx(10.0)


def test_an_arm_that_holds_still_is_hardly_ever_in_the_target():
    assert share_in_target(still, bouts=2) < 0.05
